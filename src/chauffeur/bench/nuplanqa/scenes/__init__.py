"""Questions of NuPlanQA's format about scenes of our own: staged, rendered, and answered from ground truth."""
