"""A p as the speed check prints it; the file goes when that check no longer prints one."""


def p_value(value: float) -> str:
    """Return a p as papers print it, without the zero before the point."""
    return "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0") if value < 1 else "1"
