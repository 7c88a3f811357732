#!/usr/bin/python3
"""read.py FOLDER: what tifffile, OpenCV and h5py make of exports in FOLDER: pictures.ome.tif beside png/, run.nwb beside samples.csv."""
import csv, datetime, pathlib, sys
from xml.etree import ElementTree
import cv2, h5py, numpy, tifffile

folder = pathlib.Path(sys.argv[1])


def table(path):
    rows = list(csv.DictReader(open(path)))
    return rows, lambda *columns: numpy.array([[float(r[c] or "nan") for c in columns] for r in rows])


def pictures():
    tiff = tifffile.TiffFile(folder / "pictures.ome.tif")
    stack = tiff.asarray()
    rows, _ = table(folder / "png" / "pictures.csv")
    assert tiff.is_ome and tiff.is_bigtiff and tiff.series[0].axes == "TYX", tiff.series
    assert len(stack) == len(rows) > 10, (len(stack), len(rows))
    for picture, row in zip(stack, rows):
        assert (cv2.imread(str(folder / "png" / row["file"]), cv2.IMREAD_UNCHANGED) == picture).all(), row
    good, pages = cv2.imreadmulti(str(folder / "pictures.ome.tif"), flags=cv2.IMREAD_UNCHANGED)
    assert good and len(pages) == len(stack) and all((a == b).all() for a, b in zip(pages, stack))
    space = {"o": "http://www.openmicroscopy.org/Schemas/OME/2016-06"}
    pixels = ElementTree.fromstring(tiff.ome_metadata).find(".//o:Pixels", space)
    assert abs(float(pixels.get("PhysicalSizeX")) - 0.825) < 1e-9, pixels.attrib
    many, per = tiff.pages[0].tags["XResolution"].value
    assert tiff.pages[0].tags["ResolutionUnit"].value == 3 and abs(many / per - 1 / 0.825e-4) < 0.01, (many, per)
    times = [float(plane.get("DeltaT")) for plane in pixels.findall("o:Plane", space)]
    assert times == [float(row["t_s"]) for row in rows]
    assert min(abs(stack[0].astype(int) - stack[-1]).max(), stack.std()) > 5  # they show something
    return len(stack)


# What the schema of NWB 2.6 asks of these types (https://nwb-schema.readthedocs.io), as far as it can be said in a few lines.
def nwb():
    file = h5py.File(folder / "run.nwb")
    text = lambda value: value.decode() if isinstance(value, bytes) else value
    assert text(file.attrs["neurodata_type"]) == "NWBFile" and text(file.attrs["namespace"]) == "core"
    assert text(file.attrs["nwb_version"]).startswith("2.6")
    for name in ("identifier", "session_description", "session_start_time", "timestamps_reference_time", "file_create_date"):
        value = file[name][()]
        value = value[0] if name == "file_create_date" else value
        assert text(value), name
        if name.endswith(("time", "date")):  # of a run that has just been, whatever its own clock says
            age = datetime.datetime.now(datetime.timezone.utc) - datetime.datetime.fromisoformat(text(value))
            assert datetime.timedelta() <= age < datetime.timedelta(hours=2), value
    for name in ("acquisition", "analysis", "processing", "general", "stimulus/presentation", "stimulus/templates"):
        assert isinstance(file[name], h5py.Group), name
    identities = set()
    for name, series in file["acquisition"].items():
        assert text(series.attrs["neurodata_type"]) == "TimeSeries" and text(series.attrs["namespace"]) == "core", name
        identities.add(text(series.attrs["object_id"]))
        assert text(series.attrs["description"]) and text(series.attrs["comments"]), name
        data, times = series["data"], series["timestamps"]
        assert len(data) == len(times) > 10 and times.dtype == "f8" and data.ndim in (1, 2), name
        assert (numpy.diff(times[:]) > 0).all(), name
        assert text(times.attrs["unit"]) == "seconds" and times.attrs["interval"] == 1, name
        assert text(data.attrs["unit"]) and data.attrs["conversion"] == 1 and data.attrs["offset"] == 0, name
        assert text(data.attrs["continuity"]) in ("continuous", "instantaneous", "step"), name
    assert len(identities) == len(file["acquisition"]) > 25
    _, column = table(folder / "samples.csv")
    for series, columns in (("hand_position", ("x_m", "y_m", "z_m")), ("hand_force", ("fx_N", "fy_N", "fz_N")), ("dimple_depth", ("wd_m",)),
                            ("true_force", ("true_force_N",))):
        theirs = file["acquisition"][series]["data"][:].reshape(-1, len(columns))
        ours = column(*columns)
        assert theirs.shape == ours.shape and numpy.allclose(theirs, ours, rtol=1e-8, atol=1e-15, equal_nan=True), series
    _, column = table(folder / "observations.csv")
    for series, columns in (("seen_tip_position", ("tip_x_m", "tip_y_m", "tip_z_m")), ("seen_gap", ("gap_m",))):
        theirs = file["acquisition"][series]["data"][:].reshape(-1, len(columns))
        assert numpy.allclose(theirs, column(*columns), rtol=1e-8, atol=1e-15), series
    exposure_s = column("exposure_ns")[:, 0] * 1e-9
    seen_s = file["acquisition"]["seen_gap"]["timestamps"][:]
    assert numpy.allclose(seen_s - seen_s[0], exposure_s - exposure_s[0], atol=1e-6)
    return len(file["acquisition"])


print(f"{pictures()} pictures the same in tifffile and OpenCV, {nwb()} series of NWB in h5py")
