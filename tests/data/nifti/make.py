#!/usr/bin/env python3
"""Writes NIfTI files and, in expected.txt, what nibabel reads from them: nifti_oracle_test's oracle.

    python3 make.py     (with nibabel, from PyPI; in this folder)

Per file a line: name, 12 numbers of the affine (rows), then all voxels, x fastest.
"""
import pathlib

import nibabel
import numpy as np

SHAPE = (4, 3, 2)
random = np.random.default_rng(9)


def rotation(degrees):
    """About a skew axis."""
    axis = np.array([2.0, -3.0, 6.0]) / 7
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def affine(degrees, spacing, left_handed=False):
    result = np.eye(4)
    result[:3, :3] = rotation(degrees) @ np.diag(spacing)
    if left_handed:
        result[:3, 2] *= -1
    result[:3, 3] = (-12.5, 30.25, 7.125)
    return result


def save(name, kind, dtype, order, qform=None, sform=None, slope=None):
    values = (random.random(SHAPE) * 200).astype(dtype)
    header = kind.header_class(endianness=order)
    header.set_data_dtype(dtype)
    image = kind(values, None, header)
    image.header.set_zooms((1.5, 0.5, 2.5))
    image.set_sform(None, 0)
    image.set_qform(None, 0)
    if qform is not None:
        image.set_qform(qform, 1)
    if sform is not None:
        image.set_sform(sform, 2)
    if slope is not None:
        image.header.set_slope_inter(*slope)
    nibabel.save(image, name)


skew = affine(35, (0.9, 1.1, 1.3))
skew[0, 1] += 0.25  # a shear, which no qform can say
one, two = nibabel.Nifti1Image, nibabel.Nifti2Image
pair, pair2 = nibabel.Nifti1Pair, nibabel.Nifti2Pair
save("qform.nii", one, "int16", "<", qform=affine(73, (0.7, 1.9, 3.1)))
save("qform_left.nii.gz", one, "uint8", ">", qform=affine(-140, (2, 1, 0.5), True))
save("qform_half_turn.nii", one, "float32", "<", qform=affine(180, (1, 2, 3)))
save("sform.nii.gz", one, "float32", "<", sform=skew)
save("both.nii", one, "uint16", ">", qform=affine(10, (1, 1, 1)), sform=skew)
save("second.nii", two, "float64", ">", qform=affine(100, (1, 2, 3), True))
save("second_sform.nii.gz", two, "int32", "<", sform=skew)
save("pair.hdr", pair, "int16", "<", qform=affine(-25, (1, 2, 3)))
save("pair_big.hdr", pair, "uint32", ">", sform=skew)
save("pair_second.hdr", pair2, "int8", "<", qform=affine(55, (3, 2, 1)))
save("pair_packed.img.gz", pair, "uint8", "<", sform=skew)

lines = []
for path in sorted(pathlib.Path(".").iterdir()):
    if not path.name.endswith((".nii", ".nii.gz", ".hdr", ".hdr.gz")):
        continue
    image = nibabel.load(path)
    numbers = list(image.affine[:3].ravel()) + list(np.asarray(image.dataobj).ravel(order="F"))
    lines.append(path.name + " " + " ".join(repr(float(n)) for n in numbers))
pathlib.Path("expected.txt").write_text("\n".join(lines) + "\n")
