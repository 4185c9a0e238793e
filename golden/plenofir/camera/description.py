# SPDX-License-Identifier: Apache-2.0
"""How a picture was made, written into its file as an XMP packet, for JPEG, TIFF and PNG."""

from fractions import Fraction
from xml.sax.saxutils import quoteattr

from plenofir.camera.rays.distances import State
from plenofir.camera.rays.microscope import MicroscopeModel
from plenofir.camera.rays.model import RayModel

_PACKET = """<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/">
<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description rdf:about="" xmlns:xmp="http://ns.adobe.com/xap/1.0/"
 xmlns:exif="http://ns.adobe.com/exif/1.0/" xmlns:tiff="http://ns.adobe.com/tiff/1.0/"
 xmlns:plenofir="urn:plenofir"
 {}/>
</rdf:RDF>
</x:xmpmeta>
<?xpacket end="r"?>"""
# As EXIF writes an infinite distance.
_INFINITE = "4294967295/1"


def description_of(
    micro_image_size: int,
    a: Fraction | None = None,
    model: RayModel | MicroscopeModel | None = None,
) -> bytes:
    """XMP of a picture of a light field: M and, where known, focus setting a and the camera.

    With a camera's model EXIF's properties: focus distance in m from the micro lenses (that of a,
    or of a = 0), focal length in mm, and the f-number where the entrance pupil is known. With a
    microscope's the height of a over the plane in focus, in um.
    """
    facts = {"xmp:CreatorTool": "plenofir", "plenofir:M": str(micro_image_size)}
    if a is not None:
        facts["plenofir:a"] = str(a)
    if isinstance(model, MicroscopeModel):
        facts["tiff:Model"] = model.microscope.name
        if a is not None:
            facts["plenofir:z_um"] = f"{float(model.height_um(float(a))):.6g}"
    elif model is not None:
        lens = model.camera.main_lens
        facts["tiff:Model"] = model.camera.name
        facts["exif:FocalLength"] = _rational(lens.focal_length_mm)
        if lens.entrance_pupil_diameter_mm is not None:
            number = lens.focal_length_mm / lens.entrance_pupil_diameter_mm
            facts["exif:FNumber"] = _rational(number)
        distance = model.distance(float(a or 0))
        if distance.state() == State.INFINITY:
            facts["exif:SubjectDistance"] = _INFINITE
        elif distance.state() == State.REAL:
            facts["exif:SubjectDistance"] = _rational(float(distance.mm) / 1000)
    words = "\n ".join(f"{name}={quoteattr(value)}" for name, value in facts.items())
    return _PACKET.format(words).encode()


def _rational(value: float) -> str:
    ratio = Fraction(value).limit_denominator(10_000)
    return f"{ratio.numerator}/{ratio.denominator}"
