"""All materials, and the shading of each kind."""

from renderer.jit.decorators import inlined
from renderer.materials.columns import CLEAR, KIND, LAMBERT, PHONG, REFLECTANCE, TRANSMITTANCE
from renderer.materials.dielectric import Dielectric, clear_shares
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong, diffuse_light, phong_light
from renderer.numerics.simd import load
from renderer.numerics.vec3 import largest_component, three

Material = Phong | Mirror | Dielectric


@inlined
def is_lit(materials, m):
    """Whether the material in row ``m`` reflects the light of lights."""
    return load(materials, m + KIND) >= LAMBERT


@inlined
def lets_through(materials, m):
    """Whether the material in row ``m`` transmits light."""
    return largest_component(three(materials, m + TRANSMITTANCE)) > 0.0


@inlined
def passes_light(materials, m):
    """Whether the material in row ``m`` has refracted rays, perhaps of weight 0."""
    return lets_through(materials, m) or load(materials, m + KIND) == CLEAR


@inlined
def bounced_light(materials, m, cos_i, cos_t, n1, n2):
    """The shares of light that the material in row ``m`` mirrors and lets through from the index n1 to n2, at these
    cosines to the normal; cos_t is negative under total internal reflection.
    """
    k_r, k_t = three(materials, m + REFLECTANCE), three(materials, m + TRANSMITTANCE)
    if load(materials, m + KIND) == CLEAR:
        return clear_shares(k_r, k_t, cos_i, cos_t, n1, n2)
    return k_r, k_t


@inlined
def reflected_light(materials, m, n, d, towards):
    """The share of light from the unit direction ``towards`` that the material in row ``m`` reflects against d."""
    if load(materials, m + KIND) == PHONG:
        return phong_light(materials, m, n, d, towards)
    return diffuse_light(materials, m, n, d, towards)
