"""Error against run time for every parameter that trades them: the record of the Pareto plots.

The record, ready for JSON; ``front`` always lists the names of points that no other beats, cheapest first:

    hits
      mesh, rays, judged, runs, threads, seed          the measured mesh and rays, and how
      storage[]                                        one for each family of rays
        rays, judged                                   its name, and the number of rays judged by exact arithmetic
        points[]  name                                 float64, float32, embree_default, embree_robust
                  ns_per_ray, build_seconds, bytes     bytes of Embree: null, unknown
                  errors: missed, false_hits, wrong_face, both_hit, p50, p99, max (relative, of t; null: nothing hit)
        fronts    by p50, p99 and max: the front of (ns_per_ray, that error)
      tree                                             options that must not change any answer
        default, differing_rays                        number of rays with other bits in some tree than in the default
        points[]  name, split, leaf_size, max_depth, build_seconds, bytes, ns_per_ray (by family), differing_rays
        sweeps    by parameter: the names of its points in order
        front_build_seconds_ns_per_ray                 by family
    pictures
      reference, base, size, runs                      the reference is our own; the parameters' base; pixels a side
      scenes[]
        name, reference                                its settings, and bounds on its own convergence error
        knobs     samples, max_depth, min_weight:
          points[]  name, knob, value, seconds, rays, rmse, max_error (this parameter alone converged),
                    rmse_all, max_error_all (all converged)
          front, slope_seconds, slope_value            of (seconds, rmse); exponents of rmse in seconds and in the
                                                       value by least squares, null where fewer than two have any; a
                                                       law for samples, a mere mean steepness for the other two
        front                                          of (seconds, rmse_all) over all parameters
"""

from collections.abc import Callable

from validation.benchmark.parameters import hits, pictures
from validation.scenes import SCENE_CASES


def run(quick: bool, step: Callable[[str], None]) -> dict[str, object]:
    """Measure all parameters: under 20 s when ``quick``, under 2 minutes else, once the kernels are compiled."""
    if quick:
        hit_effort = hits.HitStudyEffort(level=4, rays=10_000, judged=500, runs=5)
        branching = tuple(case for case in SCENE_CASES if case.name == "glass")
        picture_effort = pictures.PictureStudyEffort(branching, size=48, samples=256, runs=5)
    else:
        hit_effort = hits.HitStudyEffort(level=6, rays=50_000, judged=2_000, runs=5)
        picture_effort = pictures.PictureStudyEffort(SCENE_CASES, size=128, samples=1024, runs=5)
    return {"hits": hits.run(hit_effort, step), "pictures": pictures.run(picture_effort, step)}
