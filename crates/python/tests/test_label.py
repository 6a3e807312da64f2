"""Labels files and bytes: arrays, options, errors, files of carriers."""

import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

import numpy as np
import partprobe

ROOT = pathlib.Path(__file__).resolve().parents[3]
STEP = partprobe.synth(seed=7)


class Arrays(unittest.TestCase):
    def setUp(self):
        self.carrier = partprobe.label(STEP, id="bracket", attributes=["normal", "uv", "curvature"])

    def test_arrays_are_those_of_the_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bracket.npz"
            self.carrier.save(path)
            members = np.load(path)
            left_out = {"meta", "content_hash", "format_version"}
            names = set(members) - left_out
            for name in names:
                with self.subTest(name):
                    array = getattr(self.carrier, name)
                    np.testing.assert_array_equal(array, members[name])
                    self.assertIs(array, getattr(self.carrier, name))
            self.assertGreater(len(names), 20)

    def test_integers_are_signed_and_index(self):
        for name in ("triangles", "tri_face", "tri_part", "face_type", "face_label", "edge_faces", "face_color"):
            with self.subTest(name):
                self.assertEqual(getattr(self.carrier, name).dtype, np.int64)
        corners = self.carrier.vertices[self.carrier.triangles]
        self.assertEqual(corners.shape, (self.carrier.n_triangles, 3, 3))

    def test_arrays_outlive_their_carrier_and_cannot_be_written(self):
        vertices = partprobe.label(STEP).vertices
        self.assertTrue(np.isfinite(vertices).all())
        with self.assertRaises(ValueError):
            vertices[0] = 1.0

    def test_what_was_not_asked_for_is_none(self):
        self.assertIsNotNone(self.carrier.vertex_curvature)
        plain = partprobe.label(STEP)
        for name in ("vertex_normal", "vertex_uv", "vertex_curvature", "vertex_direction"):
            self.assertIsNone(getattr(plain, name))

    def test_a_carrier_comes_back_from_a_file_and_a_pickle(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "c.npz"
            for compress in (False, True):
                self.carrier.save(path, compress=compress)
                self.assertEqual(partprobe.Carrier.load(path).to_bytes(), self.carrier.to_bytes())
        self.assertEqual(pickle.loads(pickle.dumps(self.carrier)).to_bytes(), self.carrier.to_bytes())

    def test_graph_has_both_directions(self):
        graph = self.carrier.graph()
        n_edges = len(self.carrier.edge_faces)
        np.testing.assert_array_equal(graph["edge_index"][:, :n_edges], graph["edge_index"][::-1, n_edges:])
        np.testing.assert_array_equal(graph["x"][:, :11].argmax(axis=1), self.carrier.face_type)
        np.testing.assert_allclose(graph["x"][:, 11].sum(), 1.0, rtol=1e-6)
        self.assertTrue(np.isfinite(graph["edge_attr"]).all())

    def test_pictures_are_png(self):
        for label in ("part", "raw-part", "type", "face", "step-parts"):
            self.assertTrue(self.carrier.png(label, size=64).startswith(b"\x89PNG"))
        with self.assertRaisesRegex(partprobe.UsageError, "no label layer `ward-20`, only step-parts"):
            self.carrier.png("ward-20")
        self.assertEqual(self.carrier._repr_png_(), self.carrier.png())


class Labels(unittest.TestCase):
    def test_every_source_labels_triangles_or_says_why_not(self):
        carrier = partprobe.label(STEP)
        n_labeled = 0
        for pattern in partprobe.sources():
            name = pattern.split("<")[0] + ("20" if "<" in pattern else "")
            with self.subTest(name):
                try:
                    labels = carrier.labels(name)
                except partprobe.UsageError as refused:
                    self.assertTrue(str(refused))
                    continue
                self.assertEqual((labels.dtype, labels.shape), (np.int64, (carrier.n_triangles,)))
                n_labeled += 1
        self.assertGreater(n_labeled, 12)

    def test_points_have_the_labels_of_their_faces(self):
        carrier = partprobe.label(STEP)
        sample = carrier.sample(500, seed=1)
        np.testing.assert_array_equal(sample.faces, carrier.tri_face[sample.triangles])
        np.testing.assert_array_equal(sample.labels("brep-face"), sample.faces)
        np.testing.assert_array_equal(sample.labels(), carrier.face_label[sample.faces])
        self.assertEqual(len(sample), 500)

    def test_seed_and_id_decide_the_points(self):
        def points(id, seed):
            return partprobe.label(STEP, id=id).sample(50, seed).points

        np.testing.assert_array_equal(points("a", 1), points("a", 1))
        self.assertFalse((points("a", 1) == points("a", 2)).all())
        self.assertFalse((points("a", 1) == points("b", 1)).all())

    def test_a_mesh_has_the_labels_next_to_it(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "chair.obj"
            path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n")
            path.with_name("chair_labels.txt").write_text("5\n9\n")
            carrier = partprobe.label(path)
        self.assertEqual((carrier.id, carrier.kind, carrier.n_parts), ("chair", "mesh", 2))
        np.testing.assert_array_equal(carrier.labels("given"), [0, 1])


class Options(unittest.TestCase):
    def test_defaults_are_those_of_the_base_config(self):
        base = tomllib.loads((ROOT / "configs/base.toml").read_text())["label"]
        for name, value in partprobe.label_options().items():
            self.assertEqual(value, base[name], name)

    def check(self, error, words, **options):
        with self.assertRaises(error) as caught:
            partprobe.label(STEP, **options)
        self.assertIn(words, str(caught.exception))

    def test_wrong_options_are_named(self):
        self.check(TypeError, "did you mean `theta_deg`?", theta=8)
        self.check(TypeError, "did you mean `tau_min`?", tua_min=8)
        self.check(TypeError, "it belongs to the program", memory_mb=8)
        self.check(TypeError, "tau_min: ", tau_min="many")
        self.check(partprobe.UsageError, "theta_deg must be from 0 to 180", theta_deg=200.0)
        self.check(partprobe.UsageError, "tau_min: ", tau_min=-1)
        self.check(TypeError, 'layers: it must be a list of names, such as ["brep-face"]', layers="brep-face")
        self.check(partprobe.UsageError, 'unit must be "file" or "solid"', unit="face")
        self.check(partprobe.UsageError, "did you mean `normal`?", attributes=["normals"])
        self.check(partprobe.UsageError, "not a label source", layers=["nothing"])
        self.check(partprobe.UsageError, 'use it with unit="file"', unit="solid", instances=True)

    def test_options_act(self):
        fine = partprobe.label(STEP, chord_fraction=0.0005, angle_rad=0.1)
        self.assertGreater(fine.n_triangles, partprobe.label(STEP).n_triangles)
        self.assertEqual(partprobe.label(STEP, layers=["brep-face"]).layers, ("brep-face", "step-parts", "step-parts-raw"))
        raw = partprobe.label(STEP).labels("step-parts-raw", on="faces")
        self.assertEqual(raw.shape, partprobe.label(STEP).face_area.shape)
        of_points = partprobe.label(STEP).sample(50).labels("step-parts-raw")
        self.assertEqual(of_points.shape, (50,))
        self.assertEqual(partprobe.label(STEP, theta_deg=3.0).meta["theta_deg"], 3.0)


class Errors(unittest.TestCase):
    def check(self, source, error, words, status="failed", entity=None, **options):
        with self.assertRaises(error) as caught:
            partprobe.label(source, **options)
        self.assertIn(words, str(caught.exception))
        if isinstance(caught.exception, partprobe.StepError):
            self.assertEqual((caught.exception.status, caught.exception.entity), (status, entity))

    def test_a_file_that_cannot_be_labeled_says_why(self):
        self.check(b"", partprobe.StepError, "empty")
        self.check(b"solid cube", partprobe.StepError, "not a STEP file")
        self.check(STEP, partprobe.StepError, "raise label.max_triangles", status="over-budget", max_triangles=10)
        self.check(STEP, partprobe.StepError, "raise max_file_mb", status="over-budget", max_file_mb=0)
        self.check("gone.step", FileNotFoundError, "gone.step")
        for source in (None, 3, memoryview(b"")):
            self.check(source, TypeError, "give a path (str or os.PathLike), or the bytes of a STEP file")
        self.check(STEP, partprobe.StepError, "raise label.max_entities", status="over-budget", max_entities=10)

    def test_numbers_out_of_range_are_named(self):
        carrier = partprobe.label(STEP)
        for call in (lambda: carrier.sample(-1), lambda: carrier.sample(5, seed=-1), lambda: partprobe.synth(seed=2**64)):
            with self.assertRaisesRegex(partprobe.UsageError, "must"):
                call()

    def test_a_file_that_cannot_be_written_is_an_error_of_the_system(self):
        with self.assertRaises(FileNotFoundError) as caught:
            partprobe.label(STEP).save("/no such folder/a.npz")
        self.assertEqual(caught.exception.filename, "/no such folder/a.npz")

    def test_a_lost_entity_is_named(self):
        text = STEP.replace(b"PLANE(", b"PLAIN(").replace(b"CYLINDRICAL_SURFACE(", b"ROUND(")
        text = text.replace(b"CONICAL_SURFACE(", b"ROUND(").replace(b"TOROIDAL_SURFACE(", b"ROUND(")
        with self.assertRaises(partprobe.StepError) as caught:
            partprobe.label(text)
        error = caught.exception
        self.assertIsInstance(error.entity, int)
        self.assertIn(f"#{error.entity}", str(error))

    def test_an_error_names_its_file_and_can_be_pickled(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.step"
            path.write_bytes(b"nothing")
            with self.assertRaises(partprobe.StepError) as caught:
                partprobe.label(path)
            error = caught.exception
            self.assertEqual(error.file, str(path))
            self.assertTrue(str(error).startswith(str(path)))
            again = pickle.loads(pickle.dumps(error))
            self.assertEqual((str(again), again.file, again.status), (str(error), error.file, error.status))

    def test_a_damaged_carrier_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.npz"
            partprobe.label(STEP).save(path)
            path.write_bytes(path.read_bytes()[:-40])
            with self.assertRaises(partprobe.DamagedFileError) as caught:
                partprobe.Carrier.load(path)
            self.assertEqual(caught.exception.file, str(path))
            self.check(path, partprobe.UsageError, "Carrier.load")

    def test_all_shapes_of_a_file(self):
        carriers = partprobe.label_all(STEP, id="a", unit="solid")
        self.assertEqual([carrier.id for carrier in carriers], ["a__s0"])

    def test_ctrl_c_ends_the_wait(self):
        # A shell that starts this test in the background has it ignore Ctrl-C, and children inherit that.
        script = (
            "import signal, partprobe\n"
            "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
            "step = partprobe.synth(seed=3, min_parts=30, max_parts=40)\n"
            "print('ready', flush=True)\n"
            "while True: partprobe.label(step, chord_fraction=1e-4, angle_rad=0.02)\n"
        )
        process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(process.stdout.readline(), "ready\n")
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertIn("KeyboardInterrupt", errors)


if __name__ == "__main__":
    unittest.main()
