"""BEV-LLM (paper Sec. IV-C, Eq. 9-10, Fig. 5): multi-view pictures and their history fused in a bird's-eye view, and
read by a language model through cross-attention."""
