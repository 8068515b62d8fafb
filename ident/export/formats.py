"""What an identified arm can be written as: for each format its writer, and what it leaves out."""

from collections.abc import Callable, Mapping

from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.programs import left_out_of_c, left_out_of_python, to_c, to_python
from ident.export.urdf import left_out_of_urdf, to_urdf
from ident.model.identified_model import Model

WRITERS: Mapping[str, tuple[Callable[[Model], str], Callable[[Model], list[str]]]] = {
    "urdf": (to_urdf, left_out_of_urdf),
    "mjcf": (to_mjcf, left_out_of_mjcf),
    "c": (to_c, left_out_of_c),
    "python": (to_python, left_out_of_python),
}
