#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""libbsdfrbf_preload.so under the unmodified pyradiance: our files are answered for, all others are passed on.
Environment: BUILD_DIR."""
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD = os.path.abspath(os.environ.get('BUILD_DIR', os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'build')))
PRELOAD = os.path.join(BUILD, 'lib', 'libbsdfrbf_preload.so')
PAIRS = [(28, 0, 155, 172), (155, 172, 28, 0), (28, 180, 151, 0), (50, 40, 120, 230), (10, 0, 30, 50)]  # degrees
ANSWERS = """
import json, sys
from pyradiance import bsdf
sd = bsdf.load_file(sys.argv[1])
if sd is None:
    sys.exit(7)
print(json.dumps({'value': [list(bsdf.query(sd, *p)) for p in json.loads(sys.argv[2])],
                  'dhr': bsdf.direct_hemi(sd, 28, 0, bsdf.SAMPLE_ALL), 'sample': bsdf.sample(sd, 28, 0, 500, bsdf.SAMPLE_ALL).tolist(),
                  'size': list(bsdf.size(sd, 28, 0, bsdf.QUERY_MIN + bsdf.QUERY_MAX))}))
"""
# The binding's own clean-up at exit crashes, with or without us.
TRACE = """
import json, os, sys
import numpy, pyradiance
from pyradiance import radiance_ext
radiance_ext.set_option(['-ab', '1', '-ad', '4096', '-lw', '1e-6', '-w-'])
manager, got = pyradiance.RtraceSimulManager(), []
if not manager.load_octree(sys.argv[1]):
    os._exit(7)
manager.set_thread_count(1)
manager.set_cooked_call(lambda ray, *more: got.append(str(ray.rcol)) or 0)
manager.enqueue_bundle(numpy.array([[0., -1, 0], [0, 1, 0]]), 1)
manager.flush_queue()
print(got[0], flush=True)
os._exit(0)
"""
SCENE = 'void glow g\n0\n0\n4 1 1 1 0\ng source sky\n0\n0\n4 0 0 1 360\nvoid BSDF m\n6 0 {} 0 0 1 .\n0\n0\nm polygon p\n0\n0\n' \
        '12 -1 0 -1  1 0 -1  1 0 1  -1 0 1\n'


def run(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, **more)


def program(name, *arguments, **more):
    done = run(os.path.join(BUILD, 'bin', name), *arguments, **more)
    if done.returncode:
        raise AssertionError(f'{name}: {done.stderr}')
    return done.stdout


def python(script, *arguments, preload=True, **environment):
    return run(sys.executable, '-c', script, *arguments, timeout=120,
               env=dict(os.environ, **({'LD_PRELOAD': PRELOAD} if preload else {}), **environment))


class Preload(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.record = os.path.join(cls.folder, 'satin.rbf')
        program('goniometer', '-held', '1', '-grid', '20', 'satin', cls.folder)
        program('mkrbf', '-q', '-l', '60', '-n', '1', '-o', cls.record, *sorted(glob.glob(cls.folder + '/[0-9]*.txt')))

    def answers(self, path, **more):
        done = python(ANSWERS, path, json.dumps(PAIRS), **more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_bsdf_module(self):
        """load_file, query, direct_hemi, sample and size answer as rbfquery does."""
        import numpy as np
        got = self.answers(self.record)
        t0, p0, t1, p1 = np.radians(np.array(PAIRS, float)).T
        text = '\n'.join(f'{np.sin(a) * np.cos(b):.9g} {np.sin(a) * np.sin(b):.9g} {np.cos(a):.9g} '
                         f'{np.sin(c) * np.cos(d):.9g} {np.sin(c) * np.sin(d):.9g} {np.cos(c):.9g}' for a, b, c, d in zip(t0, p0, t1, p1))
        want = [float(line.split()[0]) for line in program('rbfquery', '-c', self.record, input=text).splitlines()]
        np.testing.assert_allclose([v[1] for v in got['value']], want, rtol=1e-5)
        self.assertGreater(max(want), 1)
        a = np.radians(28)
        dhr = float(program('rbfquery', '-d', self.record, input=f'{np.sin(a)} 0 {np.cos(a)}').split()[1])
        self.assertAlmostEqual(got['dhr'], dhr, delta=1e-5)
        sample = np.array(got['sample'])
        self.assertTrue((sample[:, 2] < 0).all())
        np.testing.assert_allclose(sample[:, 3:], dhr, rtol=1e-4)
        self.assertGreater(min(got['size']), 0)

    def test_render_module(self):
        """RtraceSimulManager: under an even sky the pane is as bright as its transmittance."""
        scene, octree = os.path.join(self.folder, 's.rad'), os.path.join(self.folder, 's.oct')
        with open(scene, 'w') as file:
            file.write(SCENE.format(self.record))
        with open(octree, 'wb') as file:
            subprocess.run([os.path.join(BUILD, 'radiance', 'bin', 'oconv'), scene], stdout=file, check=True)
        done = python(TRACE, octree)
        self.assertEqual(done.returncode, 0, done.stderr)
        dhr = float(program('rbfquery', '-d', self.record, input='0 0 1').split()[1])
        for value in re.findall(r'[\d.]+', done.stdout):
            self.assertAlmostEqual(float(value), dhr, delta=.002)
        self.assertNotEqual(python(TRACE, octree, preload=False).returncode, 0)

    def test_other_files_are_passed_on(self):
        xml = os.path.join(self.folder, 'satin.xml')
        with open(xml, 'w') as file:
            file.write(program('rbf2klems', self.record))
        self.assertEqual(self.answers(xml), self.answers(xml, preload=False))
        for path in (os.path.join(self.folder, 'none.xml'), os.path.join(self.folder, 's.rad')):
            self.assertEqual(python(ANSWERS, path, '[]').returncode, python(ANSWERS, path, '[]', preload=False).returncode)

    def test_damaged(self):
        """Refused with the library's message, and without a crash."""
        bad = os.path.join(self.folder, 'bad.rbf')
        with open(self.record, 'rb') as file, open(bad, 'wb') as out:
            out.write(file.read()[:5000])
        done = python(ANSWERS, bad, '[]')
        self.assertEqual(done.returncode, 7, done.stderr)
        self.assertIn('bad.rbf', done.stderr)

    def test_tree_on_demand(self):
        """With BSDFRBF_FORM the module's own loader reads a tree that is made in between."""
        got = self.answers(self.record, BSDFRBF_FORM='ttree:4', XDG_CACHE_HOME=self.folder)
        self.assertTrue(glob.glob(self.folder + '/bsdfrbf/*.xml'))
        self.assertAlmostEqual(got['dhr'], self.answers(self.record)['dhr'], delta=.02)


if __name__ == '__main__':
    unittest.main()
