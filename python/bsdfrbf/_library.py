# SPDX-License-Identifier: BSD-3-Clause
"""The C library, by ctypes: where it is, and what its functions take (bsdfrbf.h). Calls release the interpreter's lock."""
import ctypes
import os
from ctypes import c_char, c_char_p, c_double, c_float, c_int, c_size_t, c_uint64, c_void_p

NAME = "libbsdfrbf.so.0"


def _load():
    """$BSDFRBF_LIBRARY, or the library that was installed with this module, or the system's."""
    path = os.environ.get("BSDFRBF_LIBRARY")
    if not path:
        path = os.path.join(os.path.dirname(__file__), NAME)
        if not os.path.exists(path):
            path = NAME
    try:
        return ctypes.CDLL(path)
    except OSError as error:
        raise ImportError(f"the C library was not found: {error}; run `pip install .` in the sources of libbsdfrbf, "
                          "or name the file in BSDFRBF_LIBRARY") from error


class BuildOptions(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("threads", c_int), ("symmetry", c_char), ("lobes", c_int), ("team", c_void_p)]


class Samples(ctypes.Structure):
    _fields_ = [("direction", c_double * 3), ("count", c_size_t), ("outgoing", ctypes.POINTER(c_double)),
                ("dsf", ctypes.POINTER(c_float))]


class ComponentInfo(ctypes.Structure): # as in bsdfrbf.h, field by field: the library fills in all of it
    _fields_ = [("symmetry", c_char), ("symmetry_text", c_char_p), ("incidences", c_int), ("vertices", c_int),
                ("triangles", c_int), ("edges", c_int), ("lobes", c_uint64), ("frames", c_int),
                ("frame_name", c_char_p * 8), ("frame_share", c_float * 8), ("residual", c_int),
                ("residual_deg", c_float), ("fit_error", c_float), ("loo_error", c_float), ("asymmetry", c_float), ("theta_max_deg", c_float),
                ("mirror_x", c_int), ("mirror_y", c_int), ("half_turn", c_int),
                ("frame_learned", c_int * 8), ("frame_beam", c_float * 64), ("excess", c_int), ("expected_error", c_float),
                ("even", c_float), ("tuned", c_int), ("filled", c_float), ("frame_limit", c_float * 8), ("mirrored", c_float)]


Warn = ctypes.CFUNCTYPE(None, c_void_p, c_char_p)
Progress = ctypes.CFUNCTYPE(c_int, c_void_p, c_char_p, c_double)

_TYPES = {
    "version": (c_char_p,),
    "context_new": (c_void_p,),
    "context_free": (None, c_void_p),
    "message": (c_char_p, c_void_p),
    "set_warning": (None, c_void_p, Warn, c_void_p),
    "set_progress": (None, c_void_p, Progress, c_void_p),
    "data_new": (c_void_p, c_void_p),
    "data_free": (None, c_void_p),
    "data_read": (c_int, c_void_p, c_void_p, c_char_p),
    "data_add": (c_int, c_void_p, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_int, c_int),
    "data_channels": (c_int, c_void_p),
    "data_incidences": (c_size_t, c_void_p, c_int),
    "data_get": (c_int, c_void_p, c_int, c_size_t, ctypes.POINTER(Samples)),
    "build_defaults": (None, ctypes.POINTER(BuildOptions)),
    "build": (c_int, c_void_p, c_void_p, ctypes.POINTER(BuildOptions), ctypes.POINTER(c_void_p)),
    "save": (c_int, c_void_p, c_void_p, c_char_p),
    "open": (c_int, c_void_p, c_char_p, ctypes.POINTER(c_void_p)),
    "close": (None, c_void_p),
    "has": (c_int, c_void_p, c_int),
    "channels": (c_int, c_void_p),
    "lambertian": (None, c_void_p, c_int, c_void_p),
    "eval_many": (None, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p),
    "eval_exitant": (None, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p),
    "dhr_many": (None, c_void_p, c_size_t, c_void_p, c_int, c_void_p),
    "sample_many": (c_size_t, c_void_p, c_size_t, c_void_p, c_int, c_void_p, c_void_p),
    "pdf_many": (None, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p),
    "get_component_info": (c_int, c_void_p, c_int, ctypes.POINTER(ComponentInfo)),
    "get_text": (c_char_p, c_void_p, c_char_p),
    "set_text": (c_int, c_void_p, c_void_p, c_char_p, c_char_p),
}


class _Functions:
    """Functions of the library without their prefix."""

    def __init__(self):
        library = _load()
        for name, (result, *arguments) in _TYPES.items():
            function = getattr(library, "bsdfrbf_" + name)
            function.restype, function.argtypes = result, arguments
            setattr(self, name, function)


c = _Functions()
