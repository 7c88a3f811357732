import cv2
import numpy as np


class cKDTree:
    """The nearest of points (n x 2), exactly, by the k-d tree of OpenCV."""

    answers = {}  # the last ones: the renderer asks everything twice, and again in each frame in which nothing moves

    def __init__(self, points):
        self.points = np.ascontiguousarray(points, np.float32)

    def query(self, at):
        at = np.ascontiguousarray(at, np.float32)
        question = self.points.tobytes(), at.tobytes()
        if question not in self.answers:
            if len(self.answers) >= 12:
                self.answers.clear()
            tree = cv2.flann_Index(self.points, dict(algorithm=4, trees=1))
            index, square = tree.knnSearch(at, 1, params=dict(checks=-1))
            self.answers[question] = np.sqrt(square[:, 0]), index[:, 0].astype(np.int64)
        return self.answers[question]
