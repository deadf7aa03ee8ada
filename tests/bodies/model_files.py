"""Small files of other programs' formats, written from a body's matrices as those programs write them."""

import struct

import numpy as np
import scipy.sparse as sp

NUMBER = {"x": 1, "y": 2, "z": 3}


def labels(body):
    """(node, component number) of each degree of freedom."""
    return [(int(node), NUMBER[axis]) for node, axis in (name.split() for name in body.dof_names)]


def entries(matrix, triangle=None):
    part = sp.coo_array(matrix if triangle is None else {"upper": sp.triu, "lower": sp.tril}[triangle](matrix))
    return list(zip(part.row.tolist(), part.col.tolist(), part.data.tolist(), strict=True))


def write_coordinates(path, matrix, triangle=None):
    path.write_text("".join(f"{i + 1} {j + 1}  {value:.17e}\n" for i, j, value in entries(matrix, triangle)))


def write_matrix_input(path, matrix, names, held=()):
    """Abaqus, FORMAT=MATRIX INPUT: one triangle, held degrees of freedom by a penalty of 1e36."""
    lines = ["** Assembled matrix\n", *(f"{node},{dof}, {node},{dof}, 1.0e+36\n" for node, dof in held)]
    lines += [f"{names[i][0]},{names[i][1]}, {names[j][0]},{names[j][1]}, {value:.17e}\n"
              for i, j, value in entries(matrix, "lower")]
    path.write_text("".join(lines))


def write_calculix(stem, stiffness, mass, names):
    write_coordinates(stem.with_suffix(".sti"), stiffness, "upper")
    write_coordinates(stem.with_suffix(".mas"), mass, "upper")
    stem.with_suffix(".dof").write_text("".join(f"{node}.{dof}\n" for node, dof in names))


def write_harwell_boeing(path, matrix):
    """RSA: the lower triangle by columns, numbers without blanks between them."""
    lower = sp.csc_array(sp.tril(matrix))
    lower.sort_indices()

    def block(values, one, a_line):
        words = [one(value) for value in values]
        return ["".join(words[at:at + a_line]) for at in range(0, len(words), a_line)]

    pointers = block(lower.indptr + 1, "{:8d}".format, 10)
    rows = block(lower.indices + 1, "{:8d}".format, 10)
    values = block(lower.data, lambda value: f"{value:24.16E}".replace("E", "D"), 3)
    n = matrix.shape[0]
    counts = [len(pointers) + len(rows) + len(values), len(pointers), len(rows), len(values), 0]
    path.write_text("\n".join([f"{'a small body':72s}KEY     ", "".join(f"{count:14d}" for count in counts),
                               f"RSA           {n:14d}{n:14d}{lower.nnz:14d}{0:14d}",
                               f"{'(10I8)':16s}{'(10I8)':16s}{'(1P,3D24.16)':20s}", *pointers, *rows, *values]) + "\n")


def write_punch(path, matrices, names, long_fields=True):
    """DMIG, form 6: a column at a time, with one triangle and D exponents."""
    lines = []
    for title, matrix in matrices.items():
        lines.append(f"DMIG    {title:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':16s}{matrix.shape[0]:8d}")
        columns = sp.csc_array(sp.triu(matrix))
        for j in range(matrix.shape[0]):
            rows = range(columns.indptr[j], columns.indptr[j + 1])
            if not len(rows):
                continue
            words = [(names[columns.indices[at]], columns.data[at]) for at in rows]
            if long_fields:
                lines.append(f"DMIG*   {title:16s}{names[j][0]:16d}{names[j][1]:16d}")
                lines += [f"*       {node:16d}{dof:16d}{value:16.9E}".replace("E", "D") for (node, dof), value in words]
            else:  # between commas, two entries a line after the first
                data = [f"{node},{dof},{value:.16e}," for (node, dof), value in words]
                lines.append(f"DMIG,{title},{names[j][0]},{names[j][1]},,{data[0]}")
                lines += ["," + ",".join(data[at:at + 2]) for at in range(1, len(data), 2)]
    path.write_text("\n".join(lines) + "\n")


def write_full(path, stiffness, mass, names, held):
    """Ansys .full, assembled symbolically: upper triangle by rows, held equations in front with an entry of 1."""
    nodes = sorted({node for node, _ in (*names, *held)})
    n = 3 * len(nodes)
    place = {(node, dof): 3 * i + dof - 1 for i, node in enumerate(nodes) for dof in (1, 2, 3)}
    words, start = [], {}

    def record(values, kind="i"):
        data = np.asarray(values, dtype={"i": "<i4", "d": "<f8"}[kind]).tobytes()
        words.append(struct.pack("<ii", len(data) // 4, -2**31 if kind == "i" else 0) + data
                     + struct.pack("<i", len(data) // 4))

    def block(matrix):
        """(an index record and a value record a row; entries stored)"""
        where = np.array([place[name] for name in names])
        full = sp.coo_array((matrix.tocoo().data, (where[matrix.tocoo().row], where[matrix.tocoo().col])), shape=(n, n))
        rows, count = sp.csr_array(sp.triu(full)), 0
        for i in range(n):
            at = slice(rows.indptr[i], rows.indptr[i + 1])
            columns, values = rows.indices[at], rows.data[at]
            if not len(columns):
                columns, values = np.array([i]), np.array([1.0])
            order = np.argsort(columns != i, kind="stable")[::-1]  # the diagonal last
            record(columns[order] + 1)
            record(values[order], "d")
            count += len(columns)
        return count

    def here():
        return sum(map(len, words)) // 4

    header = [0] * 100
    standard = np.zeros(100, dtype="<i4")
    standard[:5] = 4, -1, 100000, 20200101, 0
    standard[9] = struct.unpack("<i", b"0.51")[0]
    for turn in range(2):  # the second time with the pointers that the first time found
        words.clear()
        words.append(struct.pack("<ii", 100, -2**31) + standard.tobytes() + struct.pack("<i", 100))
        record(header)
        record([1, 2, 3])
        record(nodes)
        start["stiffness"] = here()
        count_k = block(stiffness)
        start["mass"] = here()
        count_m = block(mass)
        start["dofs"] = here()
        record([3] * len(nodes))
        record([-1 if (node, dof) in held else 1 for node in nodes for dof in (1, 2, 3)])
        if turn == 0:
            header[0], header[1], header[3], header[7], header[32] = -4, n, 2, 3, len(nodes)
            header[8], header[33] = count_k, count_m
            header[18], header[26], header[35] = start["stiffness"], start["mass"], start["dofs"]
    path.write_bytes(b"".join(words))
