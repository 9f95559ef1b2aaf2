"""The one network stack: a transformer, vision encoders, and the connector between them."""
