//! Label sources: rules and segmentations that label the triangles of a carrier.
