"""Reads a data set that the program of the wheel labeled, also in worker processes as a loader has them."""

import multiprocessing
import os
import pathlib
import pickle
import unittest

import numpy as np
import partprobe
from material import N_PARTS, Material, program


def setUpModule():
    global MATERIAL
    MATERIAL = Material()


def tearDownModule():
    MATERIAL.remove()


def labels_of(dataset, index):
    return dataset[index]["labels"]


class Items(unittest.TestCase):
    def setUp(self):
        self.dataset = partprobe.Dataset(MATERIAL.dataset, n_points=300, seed=5)

    def test_all_shapes_are_there_and_the_damaged_file_is_named(self):
        self.assertEqual(len(self.dataset), N_PARTS)
        self.assertEqual(self.dataset.ids, [f"parts__part{index}" for index in range(N_PARTS)])
        [(source, status, reason)] = self.dataset.failed
        self.assertEqual((source, status), ("parts/empty.step", "failed"))
        self.assertIn("empty", reason)

    def test_an_item_is_the_sample_of_its_carrier(self):
        for index, item in enumerate(self.dataset):
            carrier = self.dataset.carrier(index)
            sample = carrier.sample(300, seed=5)
            self.assertEqual(item["id"], carrier.id)
            np.testing.assert_array_equal(item["points"], sample.points)
            np.testing.assert_array_equal(item["normals"], sample.normals)
            np.testing.assert_array_equal(item["labels"], sample.labels())
            item["points"][0] = 0.0
        self.assertEqual(index, N_PARTS - 1)

    def test_the_program_writes_the_same_carriers(self):
        for index, id in enumerate(self.dataset.ids):
            carrier = partprobe.label(MATERIAL.parts / f"part{index}.step", id=id)
            [path] = MATERIAL.dataset.rglob(f"{id}.npz")
            self.assertEqual(carrier.to_bytes(), path.read_bytes())

    def test_the_program_samples_the_same_points(self):
        out = MATERIAL.path / "points"
        arguments = ["--format", "npz", "--n-points", 300, "--seed", 5]
        finished = program("sample", MATERIAL.dataset, "--out", out, *arguments)
        self.assertEqual(finished.returncode, 0, finished.stderr)
        for item in self.dataset:
            [path] = out.rglob(f"{item['id']}.npz")
            members = np.load(path)
            np.testing.assert_array_equal(item["points"], members["points"])
            np.testing.assert_array_equal(item["labels"], members["label_step-parts"])

    def test_indices_and_ids(self):
        last = self.dataset[-1]
        np.testing.assert_array_equal(last["points"], self.dataset[N_PARTS - 1]["points"])
        self.assertEqual([item["id"] for item in self.dataset], self.dataset.ids)
        by_id = self.dataset.carrier(last["id"])
        self.assertEqual(by_id.to_bytes(), self.dataset.carrier(-1).to_bytes())
        for index in (N_PARTS, -N_PARTS - 1):
            with self.assertRaises(IndexError):
                self.dataset[index]
        with self.assertRaises(KeyError):
            self.dataset.carrier("nothing")

    def test_graphs_have_the_labels_of_the_data_set(self):
        dataset = partprobe.Dataset(MATERIAL.dataset, source="brep-face")
        graph = dataset.graph(0)
        np.testing.assert_array_equal(graph["y"], np.arange(dataset.carrier(0).n_faces))

    def test_workers_see_the_same_items(self):
        expected = [item["labels"] for item in self.dataset]
        for method in ("fork", "spawn"):
            with self.subTest(method), multiprocessing.get_context(method).Pool(2) as pool:
                found = pool.starmap(labels_of, [(self.dataset, index) for index in range(N_PARTS)])
                for a, b in zip(expected, found, strict=True):
                    np.testing.assert_array_equal(a, b)

    def test_a_pickle_keeps_the_settings(self):
        dataset = partprobe.Dataset(MATERIAL.dataset, n_points=7, seed=9, source="primitive")
        again = pickle.loads(pickle.dumps(dataset))
        self.assertEqual(repr(again), repr(dataset))
        np.testing.assert_array_equal(again[0]["points"], dataset[0]["points"])

    def test_a_relative_path_stays_valid_in_another_folder(self):
        before = os.getcwd()
        try:
            os.chdir(MATERIAL.dataset)
            dataset = partprobe.Dataset(".", n_points=7)
            os.chdir("/")
            self.assertEqual(len(dataset[0]["points"]), 7)
            self.assertEqual(len(pickle.loads(pickle.dumps(dataset))), len(dataset))
        finally:
            os.chdir(before)


class Refusals(unittest.TestCase):
    def test_what_is_not_a_data_set_is_refused(self):
        for path, options, words in [
            (MATERIAL.parts, {}, "is not a data set"),
            (MATERIAL.path / "gone", {}, "is not a data set"),
            (MATERIAL.dataset, {"source": "nothing"}, "is not a label source"),
            (MATERIAL.dataset, {"normals": "smooth"}, '"triangle" or "analytic"'),
        ]:
            with self.assertRaises(partprobe.UsageError) as caught:
                partprobe.Dataset(path, **options)
            self.assertIn(words, str(caught.exception))

    def test_a_shape_that_cannot_be_sampled_is_refused(self):
        with self.assertRaises(partprobe.UsageError) as caught:
            partprobe.Dataset(MATERIAL.dataset, normals="analytic")[0]
        self.assertIn("no vertex normals", str(caught.exception))

    def test_a_carrier_that_was_changed_is_refused(self):
        dataset = partprobe.Dataset(MATERIAL.dataset)
        path = pathlib.Path(MATERIAL.dataset) / f"{dataset.ids[0]}.npz"
        whole = path.read_bytes()
        try:
            partprobe.label(partprobe.synth(seed=8), id=dataset.ids[0]).save(path)
            with self.assertRaises(partprobe.DamagedFileError):
                dataset[0]
        finally:
            path.write_bytes(whole)


if __name__ == "__main__":
    unittest.main()
