"""Every limit of the format, with its reason: one table, so that a host can copy it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from purelight_format.errors import PureLightError

MIB = 1 << 20


@dataclass(frozen=True)
class Limits:
    """Upper bounds that a reader enforces before it allocates anything.

    A caller who knows his files may lower them, `Limits(file_bytes=50 * MIB)`; the defaults are
    those of the format and cannot be raised.

    Arguments:
        file_bytes: the paper's largest set is 343 MB; below 2 GiB neither zip64 nor a split
            protobuf is ever needed.
        members: a full bundle has about 40, most of them golden vectors.
        name_depth, name_part_bytes: folders exist for readability only.
        manifest_bytes, json_depth, json_number_digits: a manifest is a few kB and four levels deep.
        network_bytes: the largest network of the paper is below 100 MB.
        network_structure_bytes: a model without its weights; the largest has 20 kB, but two bytes
            can stand for a message that takes a hundred in memory.
        nodes, initializers: the largest hand-built graph has about 500 nodes.
        node_inputs: the widest concatenation joins about 40 grid features.
        node_outputs: a split gives single columns, up to the widest layer; so do axes and sizes.
        tensor_rank: the fast map has four dimensions, and a reshape may add some.
        sample_floats: elements per sample of one intermediate; the widest layer has 768.
        sample_floats_sum: elements per sample of all intermediates; bounds time and memory of
            everything that is no matrix product.
        sample_macs: multiply-adds per sample of matrix products; the paper's student has 1.1 M.
        sample_nanoseconds: work per sample as `onnx_cost` counts it; the paper's largest network
            has a fifth (`benchmarks.worst_bundles` has pictures at the limit).
        array_bytes: an exit surface is a lamp's skin, not a scanned statue: 5 million vertices;
            64 golden maps in float64 take 393 kB.
        crowding: triangles that a ray may have to be tested against; a lamp has about five.
        finishes: materials that can be seen of a lamp; a chandelier has ten.
        vectors: golden vectors per network.
        golden_milliseconds: work of all golden vectors together, which a validator evaluates.
        layer_bytes: the USD layer holds the exit mesh as text.
        layer_words, layer_depth: words, numbers, quotations, paths and brackets of the layer, but
            for numbers in brackets; nested prims and dictionaries. Ours has about 200 and 2.
        picture_bytes: preview and photometry are for people, not for textures.
        picture_pixels: width and height of the preview; a PNG of a few kB may unpack to gigabytes.
        issues: errors, and warnings, of a report; the first ones tell what is wrong.
    """

    file_bytes: int = 1024 * MIB
    members: int = 128
    name_depth: int = 4
    name_part_bytes: int = 64
    manifest_bytes: int = MIB
    json_depth: int = 16
    json_number_digits: int = 40
    network_bytes: int = 512 * MIB
    network_structure_bytes: int = 2 * MIB
    nodes: int = 4096
    initializers: int = 4096
    node_inputs: int = 256
    node_outputs: int = 1024
    tensor_rank: int = 6
    sample_floats: int = 65_536
    sample_floats_sum: int = 1 << 20
    sample_macs: int = 16_000_000
    sample_nanoseconds: int = 2_000_000
    array_bytes: int = 64 * MIB
    crowding: int = 1024
    finishes: int = 64
    vectors: int = 1024
    golden_milliseconds: int = 2000
    layer_bytes: int = 128 * MIB
    layer_words: int = 10_000
    layer_depth: int = 16
    picture_bytes: int = 16 * MIB
    picture_pixels: int = 4096
    issues: int = 100

    def __post_init__(self) -> None:
        for field in fields(self):
            value, most = getattr(self, field.name), getattr(Limits, field.name)
            least = 1 if field.name == "issues" else 0  # One error makes a report invalid.
            if not isinstance(value, int) or not least <= value <= most:
                raise PureLightError(
                    f"the limit {field.name} cannot be {value!r}: it may be lowered from {most}"
                )


LIMITS = Limits()  # Those of the format.
