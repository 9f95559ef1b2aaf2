"""Results of benchmark runs, as tables, comparisons and a gallery: numbers and words, drawn elsewhere."""
