"""ViLaD: driving decisions by masked vision-language diffusion (paper Sec. VII)."""
