"""The look of faces, as mesh files describe it. ``renderer.scene.material`` has the materials that are drawn."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

from renderer.arguments.arrays import flag_argument
from renderer.errors import MeshError, expect
from renderer.mesh.texture import Texture, numbers

AlphaMode = Literal["opaque", "mask", "blend"]
Color = tuple[float, float, float]

_SHARES = {"alpha": (), "metallic": (), "roughness": (), "alpha_cutoff": (), "transmission": (), "base_color": (3,),
           "transmission_color": (3,)}  # fmt: skip
_AMOUNTS = {"emissive": (3,), "specular": (3,), "shininess": (), "ambient": (3,)}
_FLAGS = ("double_sided", "unlit", "mirror")


@dataclass(frozen=True)
class MeshMaterial:
    """A material of a mesh file: the metallic and rough one of glTF, with what MTL has beside.

    Colours are linear RGB. A texture multiplies the value of its name. Textures of base, emissive and specular colour
    are sRGB if they have integers; floats, and all other textures, are linear. Integers stand for 0 to 1.

    Parameters
    ----------
    name : str, default ""
        As the file has it.
    base_color : array_like, shape (3,), default (1, 1, 1)
        From 0 to 1: ``baseColorFactor``, ``Kd``.
    base_color_texture : Texture, optional
        Its alpha, if it has any, multiplies ``alpha``: ``map_Kd``.
    alpha : float, default 1
        From 0 to 1: ``d``.
    alpha_texture : Texture, optional
        The alpha of the image, or its grey if it has none: ``map_d``.
    alpha_mode : {"opaque", "mask", "blend"}, default "opaque"
        Alpha is ignored, compared with ``alpha_cutoff``, or the share of the surface that is there.
    alpha_cutoff : float, default 0.5
        A mask is there where alpha is at least this.
    metallic, roughness : float, default 0 and 1
        From 0 to 1: ``Pm`` and ``Pr`` of MTL.
    metallic_roughness_texture : Texture, optional
        Green is roughness, blue metallic.
    normal_texture, bump_texture : Texture, optional
        Normals in tangent space, or heights: ``norm`` and ``map_Bump``.
    occlusion_texture : Texture, optional
        Red is the share of ambient light.
    emissive : array_like, shape (3,), default (0, 0, 0)
        At least 0: ``emissiveFactor`` times its strength, ``Ke``.
    emissive_texture : Texture, optional
        ``map_Ke``.
    specular : array_like, shape (3,), optional
        At least 0, ``Ks``. None for a material that has no highlights of Phong.
    specular_texture : Texture, optional
        ``map_Ks``.
    shininess : float, optional
        The exponent of highlights, ``Ns``.
    ambient : array_like, shape (3,), optional
        At least 0: the share of the scene's ambient light, ``Ka``.
    mirror : bool, default False
        Whether ``specular`` reflects other surfaces too: ``illum`` 3 to 8.
    transmission : float, default 0
        From 0 to 1: the share of light that is not reflected and goes through.
    transmission_texture : Texture, optional
        Its red multiplies ``transmission``.
    transmission_color : array_like, shape (3,), default (1, 1, 1)
        From 0 to 1: filters the light that goes through, ``Tf``.
    ior : float, default 1.5
        The index of refraction, at least 1: ``Ni``.
    double_sided : bool, default False
        Whether the back of the faces is shown too.
    unlit : bool, default False
        Whether the base colour is shown as it is: ``KHR_materials_unlit``, ``illum`` 0.

    Raises
    ------
    MeshError
        For a bad value. The message names the material and the field.

    Examples
    --------
    >>> from renderer import Mesh, MeshMaterial
    >>> red, mask = MeshMaterial("red", base_color=(1, 0, 0)), MeshMaterial("leaf", alpha_mode="mask")
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], materials=[red, mask], face_materials=[1])
    >>> [material.name for material in mesh.materials], mesh.face_materials
    (['red', 'leaf'], array([1], dtype=int32))
    """

    name: str = ""
    base_color: Color = (1.0, 1.0, 1.0)
    base_color_texture: Texture | None = None
    alpha: float = 1.0
    alpha_texture: Texture | None = None
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_roughness_texture: Texture | None = None
    normal_texture: Texture | None = None
    bump_texture: Texture | None = None
    occlusion_texture: Texture | None = None
    emissive: Color = (0.0, 0.0, 0.0)
    emissive_texture: Texture | None = None
    specular: Color | None = None
    specular_texture: Texture | None = None
    shininess: float | None = None
    ambient: Color | None = None
    mirror: bool = False
    transmission: float = 0.0
    transmission_texture: Texture | None = None
    transmission_color: Color = (1.0, 1.0, 1.0)
    ior: float = 1.5
    double_sided: bool = False
    unlit: bool = False

    def __post_init__(self) -> None:
        begin = f"material {self.name!r}: " if isinstance(self.name, str) and self.name else ""
        try:
            expect(isinstance(self.name, str), "name", "a string", type(self.name).__name__)
            self._check()
        except ValueError as error:
            raise MeshError(f"{begin}{error}") from None

    def _check(self) -> None:
        """Raise ``ValueError`` for a bad value; numbers become floats and tuples of them."""
        checked = [(field, shape, 0.0, 1.0) for field, shape in _SHARES.items()]
        checked += [(field, shape, 0.0, float("inf")) for field, shape in _AMOUNTS.items()]
        for field, shape, least, most in [*checked, ("ior", (), 1.0, float("inf"))]:
            value = getattr(self, field)
            if value is not None or field not in ("specular", "shininess", "ambient"):
                object.__setattr__(self, field, numbers(field, value, shape, least, most))
        for field in _FLAGS:
            object.__setattr__(self, field, flag_argument(field, getattr(self, field)))
        modes = get_args(AlphaMode)
        expect(self.alpha_mode in modes, "alpha_mode", f"one of {', '.join(modes)}", repr(self.alpha_mode))
        for field in TEXTURES:
            value = getattr(self, field)
            expect(value is None or isinstance(value, Texture), field, "a Texture or None", repr(value))

    @property
    def textures(self) -> dict[str, Texture]:
        """The textures that there are, by the names of their fields.

        Examples
        --------
        >>> from renderer import MeshMaterial, Texture
        >>> MeshMaterial(normal_texture=Texture("bricks.png")).textures.keys()
        dict_keys(['normal_texture'])
        """
        return {field: getattr(self, field) for field in TEXTURES if getattr(self, field) is not None}


TEXTURES = tuple(field.name for field in fields(MeshMaterial) if field.name.endswith("_texture"))
