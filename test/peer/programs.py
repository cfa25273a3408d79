# SPDX-License-Identifier: BSD-3-Clause
"""The timing programs of this folder, compiled when they are first needed and whenever they or the library have changed."""
import os
import subprocess

from measured import BUILD, ROOT, WORK
from stock import Failed, run

HERE = os.path.dirname(os.path.abspath(__file__))
INTERNAL = os.path.join(BUILD, 'lib', 'libbsdfrbf-internal.a')
RADIANCE = os.path.join(BUILD, 'radiance')
LIBRARIES = ['-fopenmp', '-lqhull_r', '-lxxhash', '-lm']
RECIPES = {
    'timing': ('timing.c', ['-O2', '-w', '-std=gnu99', '-fcommon', '-DBSD', '-D_DEFAULT_SOURCE', '-I' + RADIANCE + '/source/common'],
               [RADIANCE + '/archive/libradiance-common.a', INTERNAL, *LIBRARIES]),
    'kernel': ('kernel.c', ['-O3', '-mavx2', '-mfma', '-ffast-math'], [INTERNAL, '-Wl,--wrap=rbf_kernel_sum', *LIBRARIES]),
    'transport': ('transport.cpp', ['-O2', '-w'], [INTERNAL, '-Wl,--wrap=rbf_transport_solve', *LIBRARIES]),
}


def program(name):
    source, flags, libraries = RECIPES[name]
    path, source = os.path.join(WORK, name), os.path.join(HERE, source)
    inputs = [source] + [word for word in libraries if word.endswith('.a')]
    for file in inputs:
        if not os.path.exists(file):
            raise Failed(f'{file} is not there: ./run build makes it')
    if not os.path.exists(path) or os.path.getmtime(path) < max(map(os.path.getmtime, inputs)):
        compiler = os.environ.get('CXX', 'c++') if source.endswith('.cpp') else os.environ.get('CC', 'cc')
        run([compiler, *flags, '-I' + os.path.join(ROOT, 'libbsdfrbf'), '-o', path + '.part', source, *libraries])
        os.replace(path + '.part', path)
    return path


def lines(name, *arguments):
    """What a program prints, as a list of lists of words between tabs."""
    done = subprocess.run([program(name), *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise Failed(f'{name}: {done.stderr.strip()[-300:]}')
    return [line.split('\t') for line in done.stdout.splitlines()]
