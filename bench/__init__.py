"""The harness: experiments, the evaluation loop, metrics, results and the command line."""
