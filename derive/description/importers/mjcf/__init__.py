"""MJCF, the model files of MuJoCo: compiled by MuJoCo, read as bodies, joints and loops."""
