"""Names that generated C++ must not use."""

_KEYWORDS = (
    "alignas alignof and and_eq asm bitand bitor bool catch char16_t char32_t class compl concept "
    "const_cast constexpr decltype delete dynamic_cast explicit export false friend mutable "
    "namespace new noexcept not not_eq nullptr operator or or_eq private protected public "
    "reinterpret_cast requires static_assert static_cast template this thread_local throw true try "
    "typeid typename using virtual wchar_t xor xor_eq"
)
RESERVED = frozenset([*_KEYWORDS.split(), "result"])
"""C++ keywords that C does not reserve, and a local variable of the generated functions.

Names in this list get a trailing underscore in C++ and CUDA."""


def safe(name: str) -> str:
    """Return a name that is not reserved in C++."""
    return f"{name}_" if name in RESERVED else name
