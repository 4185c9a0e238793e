"""Options that several commands have."""

from pydantic import ValidationError

from plenofir.commands.rays import integer
from plenofir.errors import InputError
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic

VARIABLES = {
    "micro_image_size": "M",
    "shifts": "A",
    "max_columns": "RAW",
    "parallel_rows": "IOTA",
    "order": "INTERPOLATION",
    "arithmetic": "ARITH",
}
"""What the user calls a field of the core."""


def arithmetic_options(name: str, fraction_bits: str, guard_bits: str) -> Arithmetic:
    """Read the options ARITH, FRACTION and GUARD.

    Parameters
    ----------
    name
        exact or stored.
    fraction_bits, guard_bits
        Of stored products; empty for the defaults.

    Returns
    -------
    Arithmetic
        What they mean.

    Raises
    ------
    InputError
        If they mean nothing.
    """
    if name == "exact":
        if fraction_bits or guard_bits:
            raise InputError(
                "exact arithmetic has no fraction or guard bits",
                where="ARITH",
                expected="ARITH=stored with FRACTION or GUARD",
            )
        return ExactArithmetic()
    if name != "stored":
        raise InputError(f"{name!r} is no arithmetic", where="ARITH", expected="exact or stored")
    bits = {}
    if fraction_bits:
        bits["fraction_bits"] = integer(fraction_bits, "FRACTION")
    if guard_bits:
        bits["guard_bits"] = integer(guard_bits, "GUARD")
    try:
        return StoredProductArithmetic.model_validate(bits)
    except ValidationError as error:
        first = error.errors()[0]
        field = str(first["loc"][0]) if first["loc"] else "guard_bits"
        raise InputError(
            first["msg"],
            where={"fraction_bits": "FRACTION", "guard_bits": "GUARD"}[field],
            expected="0 <= GUARD <= FRACTION <= 12",
        ) from None
