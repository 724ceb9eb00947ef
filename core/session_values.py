"""The plain values that events of a session are made of, with the bounds that honest ones keep."""

from typing import Annotated

from msgspec import Meta

Number = Annotated[float, Meta(ge=-1e12, le=1e12)]
"""Finite; nothing that is measured is larger."""
Numbers = Annotated[tuple[Number, ...], Meta(max_length=100)]
"""One a joint, or one an angle."""
SomeNumbers = Annotated[tuple[Number | None, ...], Meta(max_length=100)]
"""One a joint; None where nothing was recorded."""
Point = tuple[Number, Number, Number]
UpperTriangle = tuple[Number, Number, Number, Number, Number, Number]
"""A symmetric 3x3 matrix: xx, xy, xz, yy, yz, zz."""
PositiveInt = Annotated[int, Meta(ge=1, le=2**53)]
Line = Annotated[str, Meta(max_length=200, pattern="^[^\\x00-\\x1f\\x7f-\\x9f\\u2028\\u2029\\ud800-\\udfff]*\\Z")]
"""A text on one line, without control characters."""
Text = Annotated[str, Meta(max_length=10_000, pattern="^[^\\x00-\\x08\\x0b\\x0c\\x0e-\\x1f\\x7f\\ud800-\\udfff]*\\Z")]
"""A remark of any number of lines."""
