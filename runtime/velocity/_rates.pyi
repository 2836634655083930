import numpy as np

bounds: np.ufunc
solve: np.ufunc
gradient: np.ufunc
