"""Compiles exported CUDA source by NVRTC, and loads and launches its kernels."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chasles import ChaslesError, InputValueError
from cuda.bindings import driver, nvrtc

THREADS = 128
"""Number of threads in a block. The kernels are compiled for at most this number of threads."""


@dataclass(frozen=True)
class Source:
    """The exported source of a robot.

    Attributes:
        text: The text of the CUDA header of the robot.
        headers: The texts of the headers that the robot's header includes, keyed by file name.
    """

    text: str
    headers: dict[str, str]


def read(path: Path) -> Source:
    """Return the CUDA source file at a path, with the headers in the same folder."""
    names = ("chasles_cuda.cuh", "chasles_float.h")
    headers = {name: (path.parent / name).read_text(encoding="utf-8") for name in names}
    return Source(path.read_text(encoding="utf-8"), headers)


def compiled(
    source: Source, robot: str, name: str, real: str, architecture: str
) -> tuple[bytes, bytes]:
    """Return (machine code of a kernel, name in the machine code).

    Raises:
        InputValueError: The source does not contain the kernel.
        ChaslesError: NVRTC does not compile the source.
    """
    space = re.search(rf"^namespace ({robot}_?)$", source.text, re.MULTILINE)
    if space is None or f" {name}_kernel(" not in source.text:
        raise InputValueError(f"robot {robot}: the export has no kernel {name}")
    headers = [text.encode() for text in source.headers.values()]
    included = [file.encode() for file in source.headers]
    program = _done(
        nvrtc.nvrtcCreateProgram(
            source.text.encode(), f"{robot}.cuh".encode(), len(headers), headers, included
        )
    )
    expression = f"chasles::{space[1]}::{name}_kernel<{real}>".encode()
    _done(nvrtc.nvrtcAddNameExpression(program, expression))
    options = [f"--gpu-architecture={architecture}".encode(), b"--std=c++17"]
    (status,) = nvrtc.nvrtcCompileProgram(program, len(options), options)
    if status != nvrtc.nvrtcResult.NVRTC_SUCCESS:
        log = bytearray(_done(nvrtc.nvrtcGetProgramLogSize(program)))
        _done(nvrtc.nvrtcGetProgramLog(program, log))
        raise ChaslesError(
            f"NVRTC does not compile kernel {name} of robot {robot}:\n{log.decode()}"
        )
    entry = bytes(_done(nvrtc.nvrtcGetLoweredName(program, expression)))
    image = bytearray(_done(nvrtc.nvrtcGetCUBINSize(program)))
    _done(nvrtc.nvrtcGetCUBIN(program, image))
    _done(nvrtc.nvrtcDestroyProgram(program))
    return bytes(image), entry


def device_of(address: int) -> int:
    """Return the number of the device whose memory contains an address."""
    attribute = driver.CUpointer_attribute.CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL
    return int(_done(driver.cuPointerGetAttribute(attribute, address)))


def architecture(device: int) -> str:
    """Return the architecture of a device, such as "sm_90"."""
    kinds = driver.CUdevice_attribute
    major, minor = (
        _done(driver.cuDeviceGetAttribute(kind, device))
        for kind in (
            kinds.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR,
            kinds.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR,
        )
    )
    return f"sm_{major}{minor}"


def loaded(image: bytes, entry: bytes, device: int) -> Any:
    """Return a compiled kernel on a GPU."""
    with _Current(device):
        module = _done(driver.cuModuleLoadData(image))
        return _done(driver.cuModuleGetFunction(module, entry))


def launch(kernel: Any, device: int, count: int, addresses: list[int], stream: int) -> None:
    """Launch a kernel with one thread for each of `count` poses."""
    values = np.array([count, *addresses], dtype=np.uint64)
    places = values.ctypes.data + values.itemsize * np.arange(len(values), dtype=np.uint64)
    blocks = -(-count // THREADS)
    with _Current(device):
        _done(
            driver.cuLaunchKernel(
                kernel, blocks, 1, 1, THREADS, 1, 1, 0, stream, places.ctypes.data, 0
            )
        )


def synchronize(device: int) -> None:
    """Wait for all kernels of a device."""
    with _Current(device):
        _done(driver.cuCtxSynchronize())


@dataclass(frozen=True)
class _Current:
    """A context manager that selects the CUDA context shared by CuPy, PyTorch and JAX."""

    device: int

    def __enter__(self) -> None:
        context = _done(driver.cuDevicePrimaryCtxRetain(self.device))
        _done(driver.cuCtxPushCurrent(context))

    def __exit__(self, *_: object) -> None:
        _done(driver.cuCtxPopCurrent())
        _done(driver.cuDevicePrimaryCtxRelease(self.device))


def _done(answer: tuple[Any, ...]) -> Any:
    """Return the result of a CUDA call.

    Raises:
        ChaslesError: The call failed.
    """
    status, *results = answer
    if int(status) != 0:
        raise ChaslesError(f"CUDA reports {status.name}")
    return results[0] if results else None
