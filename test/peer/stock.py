# SPDX-License-Identifier: BSD-3-Clause
"""The stock Radiance tools of the pyradiance wheel, run beside ours. Slow results are kept under a check sum of the data."""
import contextlib
import ctypes
import hashlib
import json
import os
import shutil
import statistics
import subprocess
import sys
import time

import numpy as np

import score as scoring

HERE = os.path.dirname(os.path.abspath(__file__))


class Failed(Exception):
    pass


def run(command, stdin=None, stdout=None, env=None):
    """(wall, cpu) seconds of a command that must succeed; stdin and stdout are file names."""
    source = open(stdin, 'rb') if stdin else subprocess.DEVNULL
    target = open(stdout, 'wb') if stdout else subprocess.DEVNULL
    start = time.monotonic()
    child = subprocess.Popen(command, stdin=source, stdout=target, stderr=subprocess.PIPE, env=env)
    message = child.stderr.read().decode(errors='replace').strip()
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.monotonic() - start
    child.returncode = os.waitstatus_to_exitcode(status)
    for f in (source, target):
        if f is not subprocess.DEVNULL:
            f.close()
    if child.returncode:
        raise Failed(f'{os.path.basename(command[0])} failed ({child.returncode}): {message[-300:]}')
    return wall, usage.ru_utime + usage.ru_stime


def median_run(command, repeat=3, limit=3., **files):
    """Medians over `repeat` runs; fewer if they take long, since long runs average the noise themselves."""
    times = [run(command, **files)]
    while len(times) < repeat and sum(t[0] for t in times) < limit:
        times.append(run(command, **files))
    return tuple(statistics.median(t[k] for t in times) for k in (0, 1))


def interleaved(runs, rounds=3):
    """Medians of what each of the functions in `runs` returns (numbers, or tuples of them), called in turn."""
    results = [[one() for one in runs] for _ in range(rounds)]
    return [np.median([row[k] for row in results], 0) for k in range(len(runs))]


@contextlib.contextmanager
def on_one_core(core):
    """Keeps this process, and what it starts, to a core: moving between them costs time that is nobody's."""
    had = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, had)


def machine():
    """What the figures were measured on."""
    with open('/proc/cpuinfo') as f:
        model = next((line.split(':', 1)[1].strip() for line in f if line.startswith('model name')), '')
    return {'processor': model, 'cores': os.cpu_count(), 'load': os.getloadavg()[0], 'date': time.strftime('%Y-%m-%d %H:%M')}


def calibration():
    """Seconds of a fixed piece of arithmetic: times from different moments are compared through it. In memory that is there already: what
    its pages cost depends on what the process did before."""
    x = np.linspace(0, 1, 1 << 16)
    y = np.ones_like(x)
    times = []
    for _ in range(9):
        start = time.process_time()
        for _ in range(20):
            np.exp(np.multiply(x, -1, out=y), out=y).sum()
        times.append(time.process_time() - start)
    return statistics.median(times)


def checksum(files):
    digest = hashlib.sha256()
    for name in sorted(files):
        with open(name, 'rb') as f:
            digest.update(f.read())
    return digest.hexdigest()[:24]


class Stock:
    def __init__(self, work, force):
        import pyradiance
        home = os.path.dirname(pyradiance.__file__)
        self.bin, self.force = os.path.join(home, 'bin'), force
        self.env = dict(os.environ, RAYPATH='.:' + os.path.join(home, 'lib'))
        self.cache = os.path.join(work, 'cache')
        # Not in the wheel, but in every full Radiance: the only stock tool that evaluates a .sir itself.
        self.query = os.environ.get('BSDFQUERY') or shutil.which('bsdfquery', path=os.environ.get('PATH', '') + ':' + work)

    def tool(self, name):
        return os.path.join(self.bin, name)

    def has(self, key, name):
        """Whether a slow result is kept, be it that the tool failed."""
        return os.path.exists(os.path.join(self.cache, key, name + '.json'))

    def slow(self, key, name, command, files):
        """Runs command > cache/key/name unless that is there. Returns (path, wall, cpu, fresh); wall and cpu of an
        earlier run are scaled to the machine's pace now. None if the tool failed, then or now."""
        folder = os.path.join(self.cache, key)
        path, note = os.path.join(folder, name), os.path.join(folder, name + '.json')
        os.makedirs(folder, exist_ok=True)
        pace = calibration()
        fresh = self.force or not os.path.exists(note)
        if fresh:
            try:
                wall, cpu = run(command + files, stdout=path + '.part', env=self.env)
                os.replace(path + '.part', path)
                facts = {'command': command, 'wall': wall, 'cpu': cpu, 'pace': (pace + calibration()) / 2}  # before and after
            except Failed as error:
                facts = {'command': command, 'failed': str(error)}
                print(f'bench: {error}', file=sys.stderr)
            with open(note, 'w') as f:
                json.dump(facts, f)
        with open(note) as f:
            facts = json.load(f)
        if 'failed' in facts:
            return None
        scale = pace / facts['pace']
        return path, facts['wall'] * scale, facts['cpu'] * scale, fresh

    def interpolant(self, key, files, threads):
        return self.slow(key, 'interpolant.sir', [self.tool('pabopto2bsdf'), '-n', str(threads)], sorted(files))

    def tree(self, key, sir, depth):
        return self.slow(key, f'tree{depth}.xml', [self.tool('bsdf2ttree'), '-g', str(depth)], [sir])

    def query_sir(self, sir, folder, channels):
        """Answers of the interpolant to query.bin, or None if there is no bsdfquery."""
        if not self.query:
            return None
        answers = os.path.join(folder, 'sir.bin')
        if self.force or not os.path.exists(answers) or os.path.getmtime(answers) < os.path.getmtime(sir):
            run([self.query, *(['-c'] if channels == 3 else []), '-ff', sir], stdin=os.path.join(folder, 'query.bin'),
                stdout=answers + '.part', env=self.env)
            os.replace(answers + '.part', answers)
        return answers


class Loops:
    """The two evaluators as libraries, called in a C loop."""

    def __init__(self, work, library):
        import pyradiance.bsdf as extension
        path = os.path.join(work, 'loop.so')
        run([os.environ.get('CC', 'cc'), '-O2', '-shared', '-fPIC', '-o', path, os.path.join(HERE, 'loop.c')])
        self.loop = ctypes.CDLL(path)
        self.radiance = ctypes.CDLL(extension.__file__)  # exports Radiance's SD functions
        self.ours = ctypes.CDLL(library)
        self.ours.bsdfrbf_context_new.restype = ctypes.c_void_p
        os.environ.setdefault('BSDFRBF_LIBRARY', library)
        sys.path.append(os.path.join(os.path.dirname(os.path.dirname(HERE)), 'python'))
        from bsdfrbf._library import ComponentInfo  # the layout of the C structure
        self.component_info = ComponentInfo

    def tree(self, xml):
        """Evaluator of a tensor tree: function of (pairs, answers)."""
        data = ctypes.create_string_buffer(1 << 14)  # room for an SDData, whatever its version
        self.radiance.SDclearBSDF(data, b'tree')
        if self.radiance.SDloadFile(data, xml.encode()):
            raise Failed('Radiance cannot load ' + xml)

        def evaluate(pairs, answers):
            if self.loop.loop_radiance(self.radiance.SDevalBSDF, data, ctypes.c_long(len(pairs)), address(pairs), address(answers)):
                raise Failed('Radiance cannot evaluate ' + xml)
        return evaluate

    def rbf(self, path):
        """(model, evaluator one by one, evaluator all at once) of a recorded file."""
        context, model = ctypes.c_void_p(self.ours.bsdfrbf_context_new()), ctypes.c_void_p()
        if self.ours.bsdfrbf_open(context, path.encode(), ctypes.byref(model)):
            raise Failed('cannot open ' + path)
        channels = self.ours.bsdfrbf_channels(model)

        def one(pairs, answers):
            self.loop.loop_rbf(self.ours.bsdfrbf_eval, model, channels, ctypes.c_long(len(pairs)), address(pairs), address(answers))

        def many(pairs, answers):
            incident, outgoing = np.ascontiguousarray(pairs[:, :3]), np.ascontiguousarray(pairs[:, 3:])
            self.ours.bsdfrbf_eval_many(model, ctypes.c_size_t(len(pairs)), address(incident), address(outgoing), address(answers))
        return model, one, many

    def info(self, model):
        """Facts of the one component that the model has."""
        for component in range(4):
            facts = self.component_info()
            if not self.ours.bsdfrbf_get_component_info(model, component, ctypes.byref(facts)):
                return facts
        raise Failed('the model has no component')


def address(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def tree_error(evaluate, folder):
    """score.py's figures of an evaluator with one channel, at the questions of a folder."""
    query = np.fromfile(os.path.join(folder, 'query.bin'), '<f4').reshape(-1, 6)
    answers = np.empty((len(query), 1), '<f4')
    evaluate(query, answers)
    return scoring.score(folder, answers)


def seconds_a_pair(evaluate, pairs, channels, repeat=7):
    """Processor time of an evaluator."""
    answers = np.empty((len(pairs), channels), '<f4')
    evaluate(pairs, answers)  # warm
    times = []
    for _ in range(repeat):
        start = time.process_time()
        evaluate(pairs, answers)
        times.append(time.process_time() - start)
    return statistics.median(times) / len(pairs)
