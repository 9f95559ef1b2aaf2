"""The one way from a trained network to what ships: an ONNX graph with int8 weights."""
