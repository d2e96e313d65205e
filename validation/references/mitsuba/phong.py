"""Whitted's surfaces as BSDFs for Mitsuba's own integrators, without scattering that Whitted's model lacks.

A path integrator uses two functions of a BSDF: ``eval`` gives the share of a light's radiance that is scattered, and
``sample`` the path's next direction. Here ``eval`` is diffuse + Phong, and ``sample`` draws delta lobes only. So direct
light is complete, mirrors and glass are followed, and no diffuse surface ever lights another: global illumination
becomes Whitted's. Everything is divided by pi, because ``scene`` multiplies the lights by it.
"""

from math import pi

import mitsuba as mi

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant before a class below derives from it
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material

_BOTH_SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
_LIT = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection | _BOTH_SIDES
_DELTA = mi.BSDFFlags.DeltaReflection | _BOTH_SIDES
_SMOOTH, _MIRROR = 0, 1


class PhongMirror(mi.BSDF):  # type: ignore[misc]  # Mitsuba's classes are Any, see pyproject.toml
    """k_d / pi + k_s (R.V)^n / pi, and a mirror of reflectance k_r, on both sides of the surface.

    Component 0 scatters the lights: it is evaluated, never sampled. Component 1 is the mirror: it is sampled with
    probability 1 and weight k_r, so nothing is random.
    """

    def __init__(self, material: Phong) -> None:
        super().__init__(mi.Properties())
        self._diffuse = mi.Color3f(*material.diffuse) / pi
        self._specular = mi.Color3f(*material.specular) / pi
        self._shininess = material.shininess
        self._reflectance = mi.Color3f(*material.reflectance)
        self._shines, self._mirrors = any(material.specular), any(material.reflectance)
        self.m_components = [_LIT, _DELTA]
        # An integrator samples lights only where a component is smooth, and each sample costs a shadow ray.
        self.m_flags = (_LIT if material.receives_light else 0) | (_DELTA if self._mirrors else 0)

    def eval(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool = True
    ) -> mi.Color3f:
        """The smooth component times the cosine, for a light in direction ``wo``; 0 from behind the surface."""
        wi = si.wi
        if not (active and wi.z * wo.z > 0.0 and ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, _SMOOTH)):
            return mi.Color3f(0.0)
        result = self._diffuse * abs(wo.z)
        if self._shines:
            # R.V with R = (-x, -y, z) of the light's direction; float32 shows above a shininess of about 1e4.
            cosine = wo.z * wi.z - wo.x * wi.x - wo.y * wi.y
            if cosine > 0.0:
                result = result + self._specular * cosine**self._shininess
        return result

    def pdf(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool = True) -> float:
        """0: no direction of the smooth component is ever sampled."""
        return 0.0

    def sample(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, sample1: float, sample2: mi.Point2f, active: bool = True
    ) -> tuple[mi.BSDFSample3f, mi.Color3f]:
        """The mirrored direction with weight k_r, or weight 0, which ends the path."""
        drawn = mi.BSDFSample3f()
        if not (active and self._mirrors and ctx.is_enabled(mi.BSDFFlags.DeltaReflection, _MIRROR)):
            return drawn, mi.Color3f(0.0)
        drawn.wo = mi.reflect(si.wi)
        drawn.pdf, drawn.eta = 1.0, 1.0
        drawn.sampled_type, drawn.sampled_component = int(mi.BSDFFlags.DeltaReflection), _MIRROR
        return drawn, self._reflectance

    def to_string(self) -> str:
        """A description for Mitsuba's messages."""
        return f"PhongMirror[{self._diffuse}, {self._specular}, {self._shininess}, {self._reflectance}]"


class Glass(mi.BSDF):  # type: ignore[misc]  # as above
    """Mitsuba's dielectric under importance transport, so that radiance inside it is not compressed by 1 / eta^2.

    On a path that enters and leaves, the factor cancels. On one that ends on a lit surface inside, it would not, and
    Whitted's model has no such factor.
    """

    _IMPORTANCE = mi.BSDFContext(mi.TransportMode.Importance)

    def __init__(self, material: Dielectric) -> None:
        super().__init__(mi.Properties())
        self._inner = mitsuba_scene.dielectric(material.ior, material.reflectance, material.transmittance)
        self.m_components = [self._inner.flags(i) for i in range(self._inner.component_count())]
        self.m_flags = self._inner.flags()

    def eval(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool = True
    ) -> mi.Color3f:
        """0: there are delta lobes only."""
        return mi.Color3f(0.0)

    def pdf(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: bool = True) -> float:
        """0: there are delta lobes only."""
        return 0.0

    def sample(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, sample1: float, sample2: mi.Point2f, active: bool = True
    ) -> tuple[mi.BSDFSample3f, mi.Color3f]:
        """Reflection or refraction, drawn by Fresnel's share; only the component of ``ctx`` is used."""
        context = self._IMPORTANCE
        if ctx.component != context.component:
            context = mi.BSDFContext(mi.TransportMode.Importance)
            context.component = ctx.component
        return self._inner.sample(context, si, sample1, sample2, active)

    def to_string(self) -> str:
        """A description for Mitsuba's messages."""
        return f"Glass[{self._inner}]"


def bsdf(material: Material) -> mi.BSDF:
    """The BSDF of a material; it omits constant transmission and ambient light."""
    if isinstance(material, Mirror):
        return mitsuba_scene.mirror(material.reflectance)
    return Glass(material) if isinstance(material, Dielectric) else PhongMirror(material)


def unlit(material: Material) -> mi.BSDF:
    """The material's mirror or glass alone, without the component that scatters the lights."""
    if isinstance(material, Dielectric):
        return Glass(material)
    return mitsuba_scene.mirror(material.reflectance)
