"""The harness: experiments, the evaluation loop, metrics, results and the command line.

Its public functions are those of `import trackmark`.
"""

if __name__ != "trackmark.bench":
    raise ImportError("Import `trackmark.bench` instead of `bench`.")
