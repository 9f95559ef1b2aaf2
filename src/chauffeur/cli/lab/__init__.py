"""The lab's commands: benchmarks, reports, training. They come with `chauffeur-lab`."""
