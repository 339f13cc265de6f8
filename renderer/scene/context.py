"""What the compilation of a description's parts shares: files, textures, materials, warnings."""

from dataclasses import dataclass, field

from renderer.scene.paths import Paths
from renderer.scene.textures import TextureTable


@dataclass
class Context:
    """The state of one compilation."""

    paths: Paths
    warnings: list[str] = field(default_factory=list)
    textures: TextureTable = field(default_factory=TextureTable)

    def warn(self, message: str, place: str) -> None:
        """Note something that a user should know, but that does not keep the scene from being rendered."""
        self.warnings.append(f"{place}: {message}")
