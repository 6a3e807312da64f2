//! Backbones, discriminative loss, training and embedding.
