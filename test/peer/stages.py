# SPDX-License-Identifier: BSD-3-Clause
"""stages.py LIBRARY LOBES OUT.rbf FILES...: builds with one thread and prints as JSON the processor seconds of each stage, the memory
that the build took at its peak (bytes, above what Python had before), and the size of the record, as it is and if nothing were packed. LOBES as -l of mkrbf, 0: automatic.
Imports little, as its own memory would hide what is measured."""
import ctypes
import json
import os
import sys
import time


def peak():
    """Bytes. Not getrusage(): its maximum is handed down from the process that started this one."""
    with open('/proc/self/status') as f:
        return next(int(line.split()[1]) * 1024 for line in f if line.startswith('VmHWM:'))


class Options(ctypes.Structure):
    """bsdfrbf_build_options"""
    _fields_ = [('size', ctypes.c_size_t), ('threads', ctypes.c_int), ('symmetry', ctypes.c_char), ('lobes', ctypes.c_int), ('team', ctypes.c_void_p)]


def main(library, lobes, output, files):
    lib = ctypes.CDLL(library)
    for name in ('bsdfrbf_context_new', 'bsdfrbf_data_new'):
        getattr(lib, name).restype = ctypes.c_void_p
    lib.bsdfrbf_message.restype = ctypes.c_char_p
    context, model, seconds = ctypes.c_void_p(lib.bsdfrbf_context_new()), ctypes.c_void_p(), {}
    data = ctypes.c_void_p(lib.bsdfrbf_data_new(context))
    before, last = peak(), ['read', time.process_time()]

    def enter(name):
        now = time.process_time()
        seconds[last[0]] = seconds.get(last[0], 0) + now - last[1]
        last[:] = [name, now]

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double)
    def progress(_, stage, done):
        enter(stage.decode())
        return 0

    def expect(status):
        if status:
            sys.exit(f'stages: {lib.bsdfrbf_message(context).decode()}')
    lib.bsdfrbf_set_progress(context, progress, None)
    for file in files:
        expect(lib.bsdfrbf_data_read(context, data, file.encode()))
    enter('lobes')
    options = Options()
    lib.bsdfrbf_build_defaults(ctypes.byref(options))
    if options.size != ctypes.sizeof(options):
        sys.exit('stages: bsdfrbf_build_options has changed')
    options.threads, options.lobes = 1, lobes
    expect(lib.bsdfrbf_build(context, data, ctypes.byref(options), ctypes.byref(model)))
    plain, size = 0, ctypes.c_uint64()
    for section in range(lib.bsdfrbf_get_section(model, -1, None, None, None)):
        lib.bsdfrbf_get_section(model, section, None, None, ctypes.byref(size))
        plain += size.value
    enter('save')
    expect(lib.bsdfrbf_save(context, model, output.encode()))
    enter('end')
    seconds.pop('done', None)
    print(json.dumps({'seconds': seconds, 'memory': peak() - before, 'bytes': os.path.getsize(output), 'plain': plain}))


if __name__ == '__main__':
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4:])
