"""Levels of processors for compiling kernels ahead; does not import the compiler."""

# Folders of kernels compiled ahead, separated as in PATH.
AHEAD_VARIABLE = "OCTREE_RENDERER_KERNELS"

# LLVM's name of each level, best first.
LEVELS = {"x86-64-v4": "x86-64-v4", "x86-64-v3": "x86-64-v3", "x86-64-v2": "x86-64-v2", "aarch64": "generic"}

# The features that a machine must have to run a level, by LLVM's names: for x86-64 those of the psABI.
_V2 = ("cx16", "popcnt", "sse3", "sse4.1", "sse4.2", "ssse3")
_V3 = (*_V2, "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
_V4 = (*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")
FEATURES = {"x86-64-v4": _V4, "x86-64-v3": _V3, "x86-64-v2": _V2, "aarch64": ("neon",)}


def lacking(level: str) -> list[str]:
    """The features of a level that this machine lacks."""
    # Of the compiler's parts only that which knows the processor.
    from llvmlite import binding  # type: ignore[import-untyped]

    has = binding.get_host_cpu_features()
    return [feature for feature in FEATURES[level] if not has.get(feature, False)]
