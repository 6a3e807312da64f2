"""Scores clusters and embeddings, and compares with the program."""

import json
import pathlib
import tempfile
import unittest

import numpy as np
import partprobe
from material import program


class Scores(unittest.TestCase):
    def check_refused(self, words, *arguments, **options):
        with self.assertRaises(partprobe.UsageError) as caught:
            partprobe.score(*arguments, **options)
        self.assertIn(words, str(caught.exception))

    def test_perfect_predictions(self):
        reference = np.array([4, 4, 2, -1], dtype=np.int16)
        clusters = partprobe.score(reference, predicted=[1, 1, 7, 7])
        rows = np.eye(2)[[0, 0, 1, 1]]
        embedded = partprobe.score(reference, embedding=rows)
        for scores in (clusters, embedded):
            self.assertEqual((scores["k"], scores["miou"], scores["accuracy"]), (2.0, 1.0, 1.0))
        self.assertEqual(embedded["gtc_miou"], 1.0)
        self.assertNotIn("gtc_miou", clusters)
        self.assertLessEqual(set(embedded) - {"k"}, set(partprobe.metrics()))

    def test_the_program_has_the_same_scores(self):
        rng = np.random.default_rng(0)
        sample = partprobe.label(partprobe.synth(seed=7)).sample(400)
        reference = sample.labels()
        embedding = rng.normal(size=(400, 8)).astype(np.float32)
        arrays = {"reference": reference, "embedding": embedding, "points": sample.points, "normals": sample.normals}
        with tempfile.TemporaryDirectory() as folder:
            np.savez(pathlib.Path(folder) / "a.npz", **arrays)
            finished = program("score", folder, "--json")
        self.assertEqual(finished.returncode, 0, finished.stderr)
        [shape] = json.loads(finished.stdout)["shapes"]
        found = partprobe.score(**arrays, id="a")
        for name, value in found.items():
            self.assertEqual(value, shape[name], name)
        self.assertIn("boundary_accuracy", found)

    def test_what_cannot_be_scored_is_named(self):
        self.check_refused("give either predicted or embedding", [0, 1])
        self.check_refused("the prediction has 1 rows for the 2 points", [0, 1], predicted=[0])
        self.check_refused("reference: it must contain whole numbers", [0.5], predicted=[0])
        self.check_refused("embedding: it must have 2 dimensions", [0], embedding=[0.5])
        self.check_refused("embedding: row 1 contains NaN", [0, 1], embedding=[[0.5], [np.nan]])
        self.check_refused("points: it must have three columns", [0], predicted=[0], points=[[0.5]])
        self.check_refused("did you mean `k-means`?", [0], embedding=[[0.5]], clusterer="kmeans")
        self.check_refused("does not fit in 32 bits", [2**40], predicted=[0])
        self.check_refused("does not fit in 32 bits", np.array([2**64 - 1], np.uint64), predicted=[0])
        self.check_refused("does not fit in 32 bits", np.array([2**64 - 1], ">u8"), predicted=[0])
        self.check_refused("did you mean `k-means`?", [0], predicted=[0], clusterer="kmeans")
        self.check_refused("a seed must be from 0 to", [0], predicted=[0], seed=-1)


if __name__ == "__main__":
    unittest.main()
