"""The viewer: runs of benchmarks and recorded trips on one page, served live or exported as one file."""
