"""The live view: a robot in the browser, with sliders and a draggable tool."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot
from chasles.arrays import real_array
from chasles.contract import as_path, check_type, requires

from .access import Access, checked_by, silent
from .display import COLOURS, Display, Displayed, Ghosts, quaternions
from .escaping import markdown
from .meshes import BodyMesh, body_meshes
from .slider_units import SliderUnit, slider_units
from .solids import BLUE
from .triangles import joined

if TYPE_CHECKING:
    from chasles.study.motion import Trajectory

FloatArray = NDArray[np.float64]

_STEP = 0.1
"""Step of a slider in displayed units: 0.1 degree or 0.1 mm."""
_RATE = 1 / 30
"""Time between frames of a played trajectory [s]."""
_GHOST_OPACITY = 0.4
_GIZMO = 0.2
"""Size of the tool handle relative to the robot size."""
_CLOUD = 20_000
"""Number of workspace points in the view."""
_LEGEND = (
    "blue: within limits · yellow: near a limit or the boundary of reach · red: beyond a limit"
)
_MODES = " · purple: assembly modes at the same actuators"
_AWAY = "The pose is out of reach: a nearby configuration with the smallest error is shown."
_OPEN = "A loop does not close at these coordinates."


class LiveView:
    """A local web page that shows a robot and lets the user move it.

    The page has a slider for each coordinate (degrees or millimeters) and a draggable coordinate
    frame at the tool. Pale robots (ghosts) show the other inverse solutions, and points show the
    workspace. A trajectory has a time slider.

    Attributes:
        address: The address of the page. The address contains an access token, so that other pages
            in the browser cannot access the view.
        displayed: The displayed configuration, with coordinates `displayed.q` (n,) [rad or m].
        handle_size: Length of the arrows of the frame at the tool [m].
        is_dragged: Whether the user is dragging the tool.
    """

    address: str
    displayed: Displayed
    handle_size: float
    is_dragged: bool

    def __init__(
        self,
        robot: Robot,
        *,
        port: int | None = None,
        urdf: str | os.PathLike[str] | None = None,
        trajectory: Trajectory | None = None,
    ) -> None:
        """Start the server, which accepts local connections only.

        Args:
            robot: The robot, from `chasles.load`.
            port: The port to listen on, or None for any free port.
            urdf: The URDF file of the robot, whose meshes are shown, or None.
            trajectory: A trajectory to play, or None.

        Warns:
            UserWarning: Mesh files were not found.

        Raises:
            NotInstalledError: viser is not installed (`pip install 'chasles[view]'`).
            InputValueError: The port is not free.
            ManifestError: The robot was derived by an earlier version of chasles. Derive it again.
        """
        check_type("LiveView: robot", robot, Robot)
        viser = _viser()
        self._display = Display(robot)
        self._lock = threading.RLock()
        self._trajectory, self._begin = trajectory, 0.0
        self._units = slider_units(robot, self._display.start.q)
        meshes = body_meshes(as_path("urdf", urdf), self._display.skeleton) if urdf else ()
        number = _free_port(port)
        access = Access()
        with checked_by(access), silent():
            self._server = viser.ViserServer("127.0.0.1", number, label=robot.name, verbose=False)
        self.address = access.address(self._server.get_port())
        self.displayed, self.is_dragged = self._display.start, False
        self.handle_size = _GIZMO * self._display.skeleton.size
        self._server.scene.set_up_direction("+z")
        self._look()
        with self._server.atomic():
            self._add_bodies(meshes)
            self._add_ghosts()
            self._add_tool()
            self._add_panel(robot)
        self._show()

    def close(self) -> None:
        """Stop the server and end the view."""
        with silent():
            self._server.stop()

    def wait(self) -> NoReturn:
        """Keep the view open until the process is interrupted, and play the trajectory, if any."""
        while True:
            time.sleep(_RATE)
            self.step()

    def step(self) -> None:
        """Show the trajectory, which repeats, at the current time. `wait` calls this method."""
        if self._trajectory is None or not self._playing.value:
            return
        self._time.value = (time.monotonic() - self._begin) % self._duration
        self._show_time(self._time.value)

    def set_q(self, q: ArrayLike) -> None:
        """Move the robot to coordinates q (n,) [rad or m].

        If a loop does not close at q, the robot stops at the last closed configuration.
        """
        with self._lock:
            self._take(self._display.at(real_array("LiveView.set_q", "q", q), self.displayed))

    def set_target(self, T: ArrayLike) -> None:
        """Move the robot to a tool pose T (4, 4) in the base frame [m].

        The robot moves to the inverse solution nearest to the displayed one. If T is out of reach,
        a nearby configuration with the smallest pose error is shown.
        """
        with self._lock:
            self._take(
                self._display.reaching(real_array("LiveView.set_target", "T", T), self.displayed)
            )

    # --- contents of the page ---

    def _look(self) -> None:
        """Set the initial camera such that the robot fills the page."""
        center, radius = self._display.ball(self._display.start)
        camera = self._server.initial_camera
        # The panel covers the right side of the page, so the camera shows the robot to the left of
        # the center.
        target = center + 0.5 * radius * np.array([0.8, 0.6, 0.0])
        camera.position = tuple(target + 2.2 * radius * np.array([0.6, -0.8, 0.45]))
        camera.look_at = tuple(target)
        self._server.scene.add_grid(
            "/ground",
            width=4 * radius,
            height=4 * radius,
            cell_size=radius / 5,
            section_size=radius,
        )

    def _add_bodies(self, meshes: Sequence[BodyMesh]) -> None:
        scene, skeleton = self._server.scene, self._display.skeleton
        self._bodies = [
            scene.add_frame(f"/robot/{body.name}", show_axes=False) for body in skeleton.bodies
        ]
        self._symbols: dict[str, list[Any]] = {}
        for k, solid in enumerate(self._display.solids):
            body = skeleton.bodies[solid.body].name
            surface = scene.add_mesh_simple(
                f"/robot/{body}/solid_{k}",
                solid.triangles.vertices.astype(np.float32),
                solid.triangles.faces.astype(np.uint32),
                color=solid.colour,
                cast_shadow=False,
                receive_shadow=False,
            )
            if solid.joint:
                self._symbols.setdefault(solid.joint, []).append(surface)
        self._meshes = [
            scene.add_mesh_trimesh(
                f"/robot/{skeleton.bodies[mesh.body].name}/mesh_{k}", mesh.surface
            )
            for k, mesh in enumerate(meshes)
        ]

    def _add_ghosts(self) -> None:
        """Add one batched mesh per body for all ghosts (transparent robots)."""
        places = self._display.most_ghosts + self._display.most_modes
        self._ghosts = []
        for k, body in enumerate(self._display.skeleton.bodies):
            parts = [solid.triangles for solid in self._display.solids if solid.body == k]
            if k == 0 or not parts or not places:
                continue
            joined_mesh = joined(parts)
            handle = self._server.scene.add_batched_meshes_simple(
                f"/ghosts/{body.name}",
                joined_mesh.vertices.astype(np.float32),
                joined_mesh.faces.astype(np.uint32),
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (places, 1)),
                batched_positions=np.zeros((places, 3)),
                batched_scales=np.zeros(places),
                batched_colors=np.zeros((places, 3), dtype=np.uint8),
                opacity=_GHOST_OPACITY,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
            self._ghosts.append((k, handle))

    def _add_tool(self) -> None:
        self._tool = self._server.scene.add_transform_controls(
            "/tool", scale=self.handle_size, depth_test=False, opacity=0.8
        )
        self._tool.on_update(self._on_drag)

    def _add_panel(self, robot: Robot) -> None:
        gui = self._server.gui
        gui.add_markdown(f"**{markdown(robot.title)}**")
        self._sliders = [
            self._slider(k, unit, q)
            for k, (unit, q) in enumerate(zip(self._units, self.displayed.q, strict=True))
        ]
        self._message = gui.add_markdown("")
        display = self._display
        self._ghosts_shown = gui.add_checkbox(
            "branches as ghosts", display.most_ghosts > 0, visible=display.most_ghosts > 0
        )
        self._modes_shown = gui.add_checkbox(
            "assembly modes as ghosts", False, visible=display.most_modes > 0
        )
        for switch in (self._ghosts_shown, self._modes_shown):
            switch.on_update(self._on_ghosts)
        self._cloud_shown = gui.add_checkbox("workspace", False)
        self._cloud_shown.on_update(self._on_cloud)
        if self._meshes:
            self._meshes_shown = gui.add_checkbox("meshes", True)
            self._meshes_shown.on_update(self._on_meshes)
        gui.add_markdown(_LEGEND + (_MODES if display.most_modes else ""))
        if self._trajectory is not None:
            end = self._duration
            self._playing = gui.add_checkbox("play", True)
            self._playing.on_update(self._on_play)
            self._time = gui.add_slider("time [s]", 0.0, end, end / 1000, 0.0)
            self._time.on_update(self._on_time)

    def _slider(self, k: int, unit: SliderUnit, q: float) -> Any:
        low, high = unit.lower * unit.factor, unit.upper * unit.factor
        value = min(max(q * unit.factor, low), high)
        slider = self._server.gui.add_slider(unit.label, low, high, _STEP, value)

        # The function is not a coroutine. With a coroutine, viser would wake its event loop each
        # time the view sets a slider value. Viser sets the client of an event only if the user
        # moved the slider.
        def on_update(event: Any) -> None:
            if event.client_id is not None:
                q = self.displayed.q.copy()
                q[k] = event.target.value / unit.factor
                self.set_q(q)

        slider.on_update(on_update)
        return slider

    # --- events caused by the user ---

    async def _on_drag(self, event: Any) -> None:
        self.is_dragged = event.phase != "end"
        if not self.is_dragged:
            with self._lock:
                self._show()
            return
        self.set_target(_pose(event.target.wxyz, event.target.position))

    async def _on_ghosts(self, _event: Any) -> None:
        with self._lock:
            self._show()

    async def _on_meshes(self, event: Any) -> None:
        for mesh in self._meshes:
            mesh.visible = event.target.value

    async def _on_cloud(self, event: Any) -> None:
        with self._lock:
            if not event.target.value:
                self._server.scene.remove_by_name("/workspace")
                return
            points = self._display.workspace(self._units, _CLOUD)
            self._server.scene.add_point_cloud(
                "/workspace",
                points.astype(np.float32),
                np.array(BLUE, dtype=np.uint8),
                point_size=0.002 * self._display.skeleton.size,
            )

    async def _on_play(self, _event: Any) -> None:
        self._begin = time.monotonic() - self._time.value

    def _on_time(self, event: Any) -> None:
        if event.client_id is not None:
            self._begin = time.monotonic() - event.target.value
            self._show_time(event.target.value)

    # --- updates of the page ---

    @property
    def _duration(self) -> float:
        """Duration of the trajectory [s], at least one frame."""
        t = np.zeros(1) if self._trajectory is None else self._trajectory.t
        return max(float(t[-1] - t[0]), _RATE)

    def _show_time(self, seconds: float) -> None:
        """Show the trajectory at a time after its start [s]."""
        if self._trajectory is not None:
            self.set_q(self._trajectory.q_at(self._trajectory.t[0] + seconds))

    def _take(self, displayed: Displayed) -> None:
        self.displayed = displayed
        self._show()

    def _show(self) -> None:
        displayed = self.displayed
        with self._server.atomic():
            for body, T, wxyz in zip(
                self._bodies, displayed.bodies, quaternions(displayed.bodies), strict=True
            ):
                _give(body, wxyz=wxyz, position=T[:3, 3])
            self._show_limits(displayed)
            for slider, unit, q in zip(self._sliders, self._units, displayed.q, strict=True):
                slider.value = float(np.clip(q, unit.lower, unit.upper) * unit.factor)
            # While the user drags the tool handle, the view does not move this handle. When the
            # user releases the handle, the handle returns to the pose of the tool.
            if not self.is_dragged:
                self._tool.wxyz = quaternions(displayed.tool)
                self._tool.position = displayed.tool[:3, 3]
            self._show_ghosts(displayed)
        _give(self._message, content=_status_text(displayed))

    def _show_limits(self, displayed: Displayed) -> None:
        for name, nearness in self._display.limits(displayed).items():
            for symbol in self._symbols.get(name, ()):
                _give(symbol, color=COLOURS[nearness])

    def _show_ghosts(self, displayed: Displayed) -> None:
        if not self._ghosts:
            return
        display = self._display
        parts = [
            find(displayed) if switch.value else display.no_ghosts(count)
            for switch, find, count in self._kinds_of_ghosts()
        ]
        ghosts = Ghosts.joined(parts)
        for k, handle in self._ghosts:
            _give(handle, visible=bool(ghosts.scales.any()))
            _give(handle, batched_scales=ghosts.scales, batched_colors=ghosts.colours)
            if ghosts.scales.any():
                handle.batched_positions = ghosts.positions[:, k]
                handle.batched_wxyzs = ghosts.wxyzs[:, k]

    def _kinds_of_ghosts(self) -> list[tuple[Any, Callable[[Displayed], Ghosts], int]]:
        """Return a tuple (checkbox, function, maximum number of ghosts) for each kind of ghost.

        The kinds of ghosts (transparent robots) are solutions and assembly modes. A kind with the
        maximum number 0 is omitted.
        """
        display = self._display
        branches = (self._ghosts_shown, display.ghosts, display.most_ghosts)
        modes = (self._modes_shown, display.modes, display.most_modes)
        return [kind for kind in (branches, modes) if kind[2]]


def _give(handle: Any, **values: Any) -> None:
    """Set only changed values. viser validates each value, and validation is slow."""
    for name, value in values.items():
        if not np.array_equal(getattr(handle, name), value):
            setattr(handle, name, value)


def _status_text(displayed: Displayed) -> str:
    x, y, z = 1000 * displayed.tool[:3, 3]
    note = "" if displayed.reached else _AWAY
    note = note if displayed.closes else _OPEN
    return f"tool: {x:.1f}, {y:.1f}, {z:.1f} mm\n\n{note}"


def _pose(wxyz: FloatArray, position: FloatArray) -> FloatArray:
    """Return the pose (4, 4) of a unit quaternion and a position."""
    w, v = wxyz[0], np.asarray(wxyz[1:], dtype=np.float64)
    T = np.eye(4)
    T[:3, :3] = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * np.cross(np.eye(3), v)
    T[:3, 3] = position
    return T


def _viser() -> Any:
    with requires("chasles[view]"):
        import viser  # noqa: PLC0415
    return viser


def _free_port(port: int | None) -> int:
    """Return the port if it is free, or any free port for None."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port or 0))
        except OSError as error:
            raise InputValueError(f"port {port}: {error.strerror}") from None
        return int(probe.getsockname()[1])
