"""The versions of what a result may depend on."""


def software_versions() -> dict[str, str]:
    """Name → version, of Python, the system, and the libraries that compute or speak to instruments."""
    import platform
    from importlib.metadata import version

    names = ("levilab", "numpy", "numba", "scipy", "pandas", "lmfit", "pyvisa", "pyvisa-py")
    return {"python": platform.python_version(), "platform": platform.platform()} | {n: version(n) for n in names}
