# SPDX-License-Identifier: BSD-3-Clause
"""Measured BSDFs as moving Gaussian lobes: build, open, evaluate and sample interpolants.

    import numpy as np, bsdfrbf
    model = bsdfrbf.build(["t00.txt", "t30.txt", "t60.txt"])    # or bsdfrbf.open("film.rbf")
    model.save("film.rbf")
    f = model.eval([0, .5, .866], outgoing)                     # sr^-1, without the cosine

Conventions (those of Radiance's bsdf.h)
  Directions  vectors that point away from the surface, of any length but 0; x, y, z in the last axis of an array. +Z is the
              front (room) normal, +X right as seen from the front, +Y up.
  Values      BSDF f in sr^-1 without the cosine; float32.
  Channels    the last axis of values: 1 (CIE Y) or 3 (CIE X, Y, Z).
  Components  "rf", "rb", "tf", "tb": incident side (front or back), reflection or transmission. "tf" takes an incident vector
              with z > 0 to outgoing vectors with z < 0. A transmission that was not measured is answered by reciprocity.

Arrays of directions broadcast against each other. Calls release the interpreter's lock; any number of threads may ask one
model. What the library refuses is raised as bsdfrbf.Error, with its message; its warnings are Python's.
"""
import ctypes
import os
import sys
import weakref
import warnings

import numpy as np

from . import _library
from ._library import c as _c

__all__ = ["Data", "Error", "Model", "build", "open"]
__version__ = _c.version().decode()

COMPONENTS = ("rf", "rb", "tf", "tb")
_STATUS = ("ok", "argument", "memory", "io", "syntax", "data", "format", "version", "unsupported", "cancelled", "internal")


class Error(Exception):
    """What the library refused. `status`: "argument", "memory", "io", "syntax", "data", "format", "version", "unsupported",
    "cancelled" or "internal"; the text names file, line and remedy where they apply."""

    def __init__(self, message, status):
        super().__init__(message)
        self.status = status


class _Call:
    """Context of one call into the library: collects warnings, raises failures."""

    def __init__(self, progress=None):
        self.pointer = _c.context_new()
        if not self.pointer:
            raise MemoryError
        self.warned, self.raised, self.progress = [], None, progress
        # kept here, as the library has no reference of its own
        self.callbacks = _library.Warn(self._warn), _library.Progress(self._progress)
        _c.set_warning(self.pointer, self.callbacks[0], None)
        if progress:
            _c.set_progress(self.pointer, self.callbacks[1], None)

    def _warn(self, _user, text):
        self.warned.append(text.decode(errors="replace"))

    def _progress(self, _user, stage, done):
        try:
            return 1 if self.progress(stage.decode(), done) else 0
        except BaseException as error:  # raised again once the library has cleaned up
            self.raised = error
            return 1

    def __enter__(self):
        return self

    def __exit__(self, *_):
        _c.context_free(self.pointer)

    def check(self, status):
        """To be called with every status. Warnings name the line that called this module."""
        if self.raised:
            raise self.raised
        level, frame = 1, sys._getframe()
        while frame.f_back and frame.f_globals is globals():
            level, frame = level + 1, frame.f_back
        for text in self.warned:
            warnings.warn(text, stacklevel=level)
        self.warned.clear()
        if status:
            name = _STATUS[status] if status < len(_STATUS) else str(status)
            raise Error(_c.message(self.pointer).decode(errors="replace") or name, name)


def _component(name):
    try:
        return COMPONENTS.index(name)
    except ValueError:
        raise ValueError(f"component {name!r}: one of {', '.join(COMPONENTS)} is wanted") from None


def _vectors(name, value, dtype=np.float32):
    value = np.asarray(value, dtype)
    if value.ndim == 0 or value.shape[-1] != 3:
        raise ValueError(f"{name}: the last axis of the array must be x, y, z; its shape is {value.shape}")
    return value


def _flat(value, shape):
    """Rows for the library: C order, `shape` before the last axis."""
    return np.ascontiguousarray(np.broadcast_to(value, shape + value.shape[-1:]))


class Data:
    """Measured samples, gathered per incident direction, component and colour."""

    def __init__(self, files=()):
        """files: paths to be read, see read()."""
        with _Call() as call:
            self._pointer = _c.data_new(call.pointer)
        if not self._pointer:
            raise MemoryError
        weakref.finalize(self, _c.data_free, self._pointer)
        for path in files:
            self.read(path)

    def read(self, path):
        """Adds a file: Mountain (PAB-Opto) text or Zemax tabular BSDF text, recognised from its content. On Error the data
        are as they were."""
        with _Call() as call:
            call.check(_c.data_read(call.pointer, self._pointer, os.fsencode(path)))

    def add(self, incident, outgoing, values, quantity="bsdf"):
        """Adds samples measured at one incident direction; both sides of the surface may be mixed.

        incident: (3,); outgoing: (n, 3); values: (n,), (n, 1) or (n, 3), sr^-1; quantity: "bsdf" (without the cosine) or
        "dsf" (times |cos(theta_o)|)."""
        incident, outgoing = _vectors("incident", incident, np.float64), _vectors("outgoing", outgoing, np.float64)
        values = np.asarray(values, np.float64)
        if incident.shape != (3,) or outgoing.ndim != 2:
            raise ValueError(f"incident must be one vector, outgoing (n, 3); they are {incident.shape}, {outgoing.shape}")
        if values.shape[:1] != outgoing.shape[:1] or values.shape[1:] not in ((), (1,), (3,)):
            raise ValueError(f"values for {len(outgoing)} outgoing directions must be (n,), (n, 1) or (n, 3); they are {values.shape}")
        if quantity not in ("bsdf", "dsf"):
            raise ValueError(f"quantity {quantity!r}: bsdf or dsf is wanted")
        incident, outgoing, values = map(np.ascontiguousarray, (incident, outgoing, values))
        with _Call() as call:
            call.check(_c.data_add(call.pointer, self._pointer, incident.ctypes.data, len(outgoing), outgoing.ctypes.data,
                                   values.ctypes.data, values.shape[1] if values.ndim == 2 else 1, quantity == "dsf"))

    @property
    def channels(self):
        """1 or 3; 0 while empty."""
        return _c.data_channels(self._pointer)

    def incidences(self, component):
        """Number of incident directions at which a component ("rf", "rb", "tf", "tb") was measured."""
        return _c.data_incidences(self._pointer, _component(component))

    def samples(self, component, index):
        """Samples of one incident direction, seen from the component's own sides (all z > 0): the direction (3,), outgoing
        directions (n, 3), and f |cos(theta_o)| (n, channels) in sr^-1. IndexError if there is no such incidence."""
        found = _library.Samples()
        if index < 0 or _c.data_get(self._pointer, _component(component), index, found):
            raise IndexError(f"{component}: no incidence {index}")
        return (np.array(found.direction), np.ctypeslib.as_array(found.outgoing, (found.count, 3)).copy(),
                np.ctypeslib.as_array(found.dsf, (found.count, self.channels)).copy())


class Model:
    """An interpolant, from open() or build(). Immutable; threads and forked processes may share it."""

    def __init__(self, pointer):
        self._pointer = pointer
        weakref.finalize(self, _c.close, pointer)

    @property
    def channels(self):
        """Channels of all values: 1 (CIE Y) or 3 (CIE X, Y, Z)."""
        return _c.channels(self._pointer)

    @property
    def components(self):
        """Names of the components that were measured."""
        return tuple(name for k, name in enumerate(COMPONENTS) if _c.has(self._pointer, k))

    @property
    def name(self):
        """The sample's name as recorded, or ""."""
        return self.text("name")

    def text(self, key):
        """A text recorded with the model: "name", "source", "command", "spikes" and "unread" (how many samples were left out as such); "" if there is none."""
        return _c.get_text(self._pointer, key.encode()).decode(errors="replace")

    def info(self, component):
        """Facts about a component, as rbfinfo(1) tells them: a dict with symmetry, incidences, lobes, fit_error, loo_error
        (leave-one-incidence-out), expected_error (between measured incidences; all relative L1, None if unknown), theta_max_deg, and frames, a dict from each frame's name
        to its share of the energy."""
        found = _library.ComponentInfo()
        if _c.get_component_info(self._pointer, _component(component), found):
            raise ValueError(f"{component}: not in this model, which has {', '.join(self.components)}")
        frames = {}
        for k in range(found.frames): # two learned ones may have one name
            name = found.frame_name[k].decode()
            frames[name] = frames.get(name, 0) + found.frame_share[k]
        return {
            "symmetry": found.symmetry_text.decode(), "incidences": found.incidences, "lobes": found.lobes,
            "fit_error": found.fit_error if found.fit_error >= 0 else None,
            "loo_error": found.loo_error if found.loo_error >= 0 else None,
            "expected_error": found.expected_error if found.expected_error >= 0 else None,
            "theta_max_deg": found.theta_max_deg,
            "frames": frames,
        }

    def eval(self, incident, outgoing):
        """BSDF f in sr^-1, Lambertian part included, without the cosine.

        incident, outgoing: (..., 3), which broadcast. Returns (..., channels). 0 where a component is missing, and where a
        vector is 0 or in the surface's plane. One incident direction with many outgoing ones is fastest."""
        incident, outgoing = _vectors("incident", incident), _vectors("outgoing", outgoing)
        shape = np.broadcast_shapes(incident.shape[:-1], outgoing.shape[:-1])
        values = np.empty(shape + (self.channels,), np.float32)
        outgoing = _flat(outgoing, shape)
        if incident.size == 3:
            incident = np.ascontiguousarray(incident)
            _c.eval_exitant(self._pointer, incident.ctypes.data, outgoing.size // 3, outgoing.ctypes.data, values.ctypes.data)
        else:
            incident = _flat(incident, shape)
            _c.eval_many(self._pointer, outgoing.size // 3, incident.ctypes.data, outgoing.ctypes.data, values.ctypes.data)
        return values

    def dhr(self, incident, transmit=False):
        """Directional-hemispherical reflectance, or transmittance: the integral of f |cos(theta_o)| over one side.

        incident: (..., 3). Returns (..., channels), Lambertian part included."""
        incident = np.ascontiguousarray(_vectors("incident", incident))
        values = np.empty(incident.shape[:-1] + (self.channels,), np.float32)
        _c.dhr_many(self._pointer, incident.size // 3, incident.ctypes.data, bool(transmit), values.ctypes.data)
        return values

    def lambertian(self, component):
        """Constant part of the component as a DHR, (channels,): f contains it as lambertian/pi; samples do not."""
        values = np.zeros(3, np.float32)
        _c.lambertian(self._pointer, _component(component), values.ctypes.data)
        return values[:self.channels]

    def sample(self, incident, u, transmit=False):
        """Outgoing unit vectors, drawn with a density proportional to (f - lambertian/pi) |cos(theta_o)|, of the luminance.

        incident: (..., 3); u: (...) in [0, 1), one number a direction: even spacing gives evenly spread directions. They
        broadcast. Returns (..., 3) float32; 0 where there is nothing to sample. Runs of the same incident direction are
        faster, most of all where reciprocity answers."""
        incident, u = _vectors("incident", incident), np.asarray(u, np.float64)
        shape = np.broadcast_shapes(incident.shape[:-1], u.shape)
        incident, u = _flat(incident, shape), np.ascontiguousarray(np.broadcast_to(u, shape))
        outgoing = np.empty(shape + (3,), np.float32)
        _c.sample_many(self._pointer, u.size, incident.ctypes.data, bool(transmit), u.ctypes.data, outgoing.ctypes.data)
        return outgoing

    def pdf(self, incident, outgoing):
        """Density, sr^-1, with which sample() returns `outgoing` on its side. (..., 3) each, broadcast. Returns (...)."""
        incident, outgoing = _vectors("incident", incident), _vectors("outgoing", outgoing)
        shape = np.broadcast_shapes(incident.shape[:-1], outgoing.shape[:-1])
        incident, outgoing = _flat(incident, shape), _flat(outgoing, shape)
        values = np.empty(shape, np.float32)
        _c.pdf_many(self._pointer, values.size, incident.ctypes.data, outgoing.ctypes.data, values.ctypes.data)
        return values

    def save(self, path):
        """Writes an .rbf file, whole or not at all."""
        with _Call() as call:
            call.check(_c.save(call.pointer, self._pointer, os.fsencode(path)))


def open(path):
    """Opens an .rbf file, or BSDF XML that carries an interpolant. Returns a Model."""
    pointer = ctypes.c_void_p()
    with _Call() as call:
        call.check(_c.open(call.pointer, os.fsencode(path), pointer))
    return Model(pointer.value)


def build(data, symmetry="auto", lobes=None, threads=None, name=None, progress=None):
    """Builds the interpolant of every component that was measured. Returns a Model.

    data: Data, or paths of measurement files, all of one sample. symmetry: "auto" (found from the data), "isotropic",
    "quadrilateral", "bilateral", "up" or "anisotropic". lobes: per incidence; None: chosen from the data. threads: None: all
    that there are. name: the sample's. progress: called as progress(stage, share done); a true answer stops with an Error
    of status "cancelled"."""
    letters = {"auto": b"\0", **{word: word[0].upper().encode() for word in
                                 ("isotropic", "quadrilateral", "bilateral", "up", "anisotropic")}}
    if symmetry not in letters:
        raise ValueError(f"symmetry {symmetry!r}: one of {', '.join(letters)} is wanted")
    if isinstance(data, (str, bytes, os.PathLike)):
        data = [data]
    if not isinstance(data, Data):
        data = Data(data)
    options = _library.BuildOptions()
    _c.build_defaults(options)
    options.symmetry, options.lobes, options.threads = letters[symmetry], lobes or 0, threads or 0
    pointer = ctypes.c_void_p()
    with _Call(progress) as call:
        call.check(_c.build(call.pointer, data._pointer, options, pointer))
        model = Model(pointer.value)
        if name is not None:
            call.check(_c.set_text(call.pointer, model._pointer, b"name", name.encode()))
    return model
