"""What tests of compiling share: the part of a script that tells for which types its process has compiled kernels."""

SIGNATURES = """
import sys
from renderer.jit.compiler import Kernel

def signatures():
    modules = [module for name, module in sys.modules.items() if name.startswith("renderer.")]
    kernels = {id(value): value for module in modules for value in vars(module).values() if isinstance(value, Kernel)}
    entries = {k.py_func.__qualname__: vars(k)["entry"] for k in kernels.values() if "entry" in vars(k)}
    return {(name, str(types)) for name, entry in entries.items() for types in entry.signatures}
"""
