//! Clustering of rows of numbers: spherical and Euclidean k-means.
