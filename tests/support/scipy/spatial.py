import cv2
import numpy as np


class cKDTree:
    """The nearest of points (n x 2), exactly, by the k-d tree of OpenCV."""

    def __init__(self, points):
        self.points = np.ascontiguousarray(points, np.float32)
        self.tree = cv2.flann_Index(self.points, dict(algorithm=4, trees=1))

    def query(self, at):
        index, square = self.tree.knnSearch(np.ascontiguousarray(at, np.float32), 1, params=dict(checks=-1))
        return np.sqrt(square[:, 0]), index[:, 0].astype(np.int64)
