// Written by `python -m web.tables` from purelight_format; do not edit.

export const CODES = {
  "PLX_FILE_TOO_LARGE": [
    "error",
    "{size} bytes, at most {limit} are allowed",
    "plux.md#c1"
  ],
  "PLX_ZIP_BAD_SIGNATURE": [
    "error",
    "this is no zip file",
    "plux.md#c2"
  ],
  "PLX_ZIP_TRUNCATED": [
    "error",
    "the file ends before its directory does",
    "plux.md#c2"
  ],
  "PLX_ZIP_TRAILING_DATA": [
    "error",
    "{size} bytes follow the end of the zip file",
    "plux.md#c2"
  ],
  "PLX_ZIP_COMMENT": [
    "error",
    "the zip file carries a comment",
    "plux.md#c2"
  ],
  "PLX_ZIP_ZIP64": [
    "error",
    "zip64 structures are not allowed",
    "plux.md#c3"
  ],
  "PLX_ZIP_ENCRYPTED": [
    "error",
    "the member is encrypted",
    "plux.md#c3"
  ],
  "PLX_ZIP_DATA_DESCRIPTOR": [
    "error",
    "the member's size follows its data",
    "plux.md#c3"
  ],
  "PLX_ZIP_COMPRESSED": [
    "error",
    "compression method {method}; members must be stored",
    "plux.md#c3"
  ],
  "PLX_ZIP_NOT_REGULAR": [
    "error",
    "the member is not a regular file",
    "plux.md#c3"
  ],
  "PLX_ZIP_NOT_CANONICAL": [
    "error",
    "{field} is {value}, must be {expected}",
    "plux.md#c4"
  ],
  "PLX_ZIP_HEADER_MISMATCH": [
    "error",
    "the directory contradicts the member: {field}",
    "plux.md#c5"
  ],
  "PLX_ZIP_GAP": [
    "error",
    "bytes that belong to no member",
    "plux.md#c6"
  ],
  "PLX_ZIP_OVERLAP": [
    "error",
    "the member reaches into what follows it",
    "plux.md#c6"
  ],
  "PLX_ZIP_MISALIGNED": [
    "error",
    "the data starts at {offset}, no multiple of 64",
    "plux.md#c7"
  ],
  "PLX_ZIP_CRC": [
    "error",
    "the data does not match its CRC-32",
    "plux.md#c8"
  ],
  "PLX_ZIP_NAME_INVALID": [
    "error",
    "{name!r} is not an allowed member name",
    "plux.md#c9"
  ],
  "PLX_ZIP_NAME_DUPLICATE": [
    "error",
    "{name!r} stands for two things",
    "plux.md#c9"
  ],
  "PLX_ZIP_TOO_MANY_MEMBERS": [
    "error",
    "{count} members, at most {limit}",
    "plux.md#c10"
  ],
  "PLX_JSON_TOO_LARGE": [
    "error",
    "{size} bytes, at most {limit} are allowed",
    "plux.md#j1"
  ],
  "PLX_JSON_ENCODING": [
    "error",
    "the text is not plain UTF-8 (byte {offset})",
    "plux.md#j1"
  ],
  "PLX_JSON_SYNTAX": [
    "error",
    "no valid JSON: {error}",
    "plux.md#j2"
  ],
  "PLX_JSON_DUPLICATE_KEY": [
    "error",
    "the key {key!r} occurs twice",
    "plux.md#j2"
  ],
  "PLX_JSON_NON_FINITE": [
    "error",
    "{number} is no finite number",
    "plux.md#j3"
  ],
  "PLX_JSON_TOO_DEEP": [
    "error",
    "nested deeper than {limit} levels",
    "plux.md#j1"
  ],
  "PLX_MANIFEST_MISSING": [
    "error",
    "the bundle has no manifest.json",
    "plux.md#m1"
  ],
  "PLX_MANIFEST_VERSION_UNSUPPORTED": [
    "error",
    "the format version is {version}, this reads {known}; update purelight",
    "plux.md#m2"
  ],
  "PLX_MANIFEST_VERSION_NEWER": [
    "warning",
    "format version {version}, read as {known}: newer fields are ignored",
    "plux.md#m2"
  ],
  "PLX_MANIFEST_SCHEMA": [
    "error",
    "the field {expected}",
    "plux.md#m3"
  ],
  "PLX_MANIFEST_UNKNOWN_FIELD": [
    "warning",
    "unknown field, kept but ignored",
    "plux.md#m4"
  ],
  "PLX_MANIFEST_UNITS": [
    "error",
    "units must be {expected}",
    "plux.md#m5"
  ],
  "PLX_MANIFEST_SPHERE_INVALID": [
    "error",
    "the radius must be in [1e-6, 1e6] m, the centre within 1e6 m of the origin",
    "plux.md#m6"
  ],
  "PLX_MANIFEST_FLUX_INVALID": [
    "error",
    "flux must be in [1e-30, 1e30] W in present channels and 0 in absent ones",
    "plux.md#m7"
  ],
  "PLX_MANIFEST_DARK": [
    "warning",
    "no channel carries flux",
    "plux.md#m7"
  ],
  "PLX_MANIFEST_SCALE_INVALID": [
    "error",
    "the radiance scale must be in [1e-30, 1e30]",
    "plux.md#m8"
  ],
  "PLX_MANIFEST_RMAX_INVALID": [
    "error",
    "r_max must be above 1 radius, at most 1e6",
    "plux.md#m9"
  ],
  "PLX_MANIFEST_NETWORK_UNKNOWN": [
    "warning",
    "no network of this name is defined; it is ignored",
    "plux.md#m10"
  ],
  "PLX_MANIFEST_NETWORK_MISSING": [
    "error",
    "the bundle needs the network {network}",
    "plux.md#m10"
  ],
  "PLX_MANIFEST_MEMBER_MISSING": [
    "error",
    "the bundle lacks the member {member}",
    "plux.md#m11"
  ],
  "PLX_MANIFEST_MEMBER_UNLISTED": [
    "error",
    "the manifest does not list this member",
    "plux.md#m11"
  ],
  "PLX_MANIFEST_DIGEST_MISMATCH": [
    "error",
    "the {what} differs from the manifest's",
    "plux.md#m12"
  ],
  "PLX_MANIFEST_COST_MISMATCH": [
    "error",
    "the manifest says {stated}, it is {actual}",
    "plux.md#m13"
  ],
  "PLX_MANIFEST_VERDICT": [
    "warning",
    "fidelity.verdict is not in the form of M15; it is ignored",
    "plux.md#m15"
  ],
  "PLX_MANIFEST_FINISH_COUNT": [
    "error",
    "{count} finishes, at most {limit}",
    "plux.md#f1"
  ],
  "PLX_MANIFEST_FINISH_ENERGY": [
    "error",
    "it reflects and lets through {total:.6} of the light",
    "plux.md#f2"
  ],
  "PLX_ONNX_TOO_LARGE": [
    "error",
    "{what}: {size}, at most {limit}",
    "onnx_profile.md#n1"
  ],
  "PLX_ONNX_PARSE": [
    "error",
    "these bytes are no ONNX model",
    "onnx_profile.md#n2"
  ],
  "PLX_ONNX_IR_VERSION": [
    "error",
    "IR version {version}, must be {expected}",
    "onnx_profile.md#n2"
  ],
  "PLX_ONNX_OPSET": [
    "error",
    "opset {version}, must be {expected}",
    "onnx_profile.md#n2"
  ],
  "PLX_ONNX_FOREIGN_DOMAIN": [
    "error",
    "the domain {domain!r} is not allowed",
    "onnx_profile.md#n3"
  ],
  "PLX_ONNX_FEATURE": [
    "error",
    "{feature} are not allowed",
    "onnx_profile.md#n4"
  ],
  "PLX_ONNX_EXTERNAL_DATA": [
    "error",
    "weights lie outside the model",
    "onnx_profile.md#n5"
  ],
  "PLX_ONNX_TENSOR_TYPE": [
    "error",
    "element type {type} is not allowed",
    "onnx_profile.md#n6"
  ],
  "PLX_ONNX_TENSOR_DATA": [
    "error",
    "the tensor is not plain: {what}",
    "onnx_profile.md#n6"
  ],
  "PLX_ONNX_NON_FINITE_WEIGHT": [
    "error",
    "a weight is not finite",
    "onnx_profile.md#n7"
  ],
  "PLX_ONNX_NAME_INVALID": [
    "error",
    "a name is empty or not printable",
    "onnx_profile.md#n8"
  ],
  "PLX_ONNX_DUPLICATE_NAME": [
    "error",
    "the name {name!r} is given twice",
    "onnx_profile.md#n8"
  ],
  "PLX_ONNX_UNDEFINED_NAME": [
    "error",
    "{name!r} is used before it is computed",
    "onnx_profile.md#n8"
  ],
  "PLX_ONNX_IO_SIGNATURE": [
    "error",
    "{what} must be {expected}",
    "onnx_profile.md#n9"
  ],
  "PLX_ONNX_OP_NOT_ALLOWED": [
    "error",
    "the profile has no operator {op}",
    "onnx_profile.md#n10"
  ],
  "PLX_ONNX_ATTRIBUTE": [
    "error",
    "not allowed: {what}",
    "onnx_profile.md#n11"
  ],
  "PLX_ONNX_SUBGRAPH": [
    "error",
    "the attribute {name!r} holds a graph",
    "onnx_profile.md#n11"
  ],
  "PLX_ONNX_SHAPE": [
    "error",
    "{op}: {what}",
    "onnx_profile.md#n12"
  ],
  "PLX_ONNX_TYPE": [
    "error",
    "{op}: {what}",
    "onnx_profile.md#n13"
  ],
  "PLX_ONNX_COST": [
    "error",
    "{size} {what} per sample, at most {limit}",
    "onnx_profile.md#n14"
  ],
  "PLX_ONNX_UNUSED_INITIALIZER": [
    "warning",
    "no node reads it",
    "onnx_profile.md#n15"
  ],
  "PLX_ONNX_METADATA": [
    "warning",
    "the model carries texts about its making",
    "onnx_profile.md#n15"
  ],
  "PLX_NPY_HEADER": [
    "error",
    "no plain .npy array: {what}",
    "plux.md#a1"
  ],
  "PLX_NPY_TYPE": [
    "error",
    "elements are {dtype}, must be {expected}",
    "plux.md#a2"
  ],
  "PLX_NPY_SHAPE": [
    "error",
    "the shape is {shape}, must be {expected}",
    "plux.md#a2"
  ],
  "PLX_NPY_SIZE": [
    "error",
    "the data has {size} bytes, the header says {expected}",
    "plux.md#a1"
  ],
  "PLX_NPY_TOO_LARGE": [
    "error",
    "{size} bytes, at most {limit}",
    "plux.md#a3"
  ],
  "PLX_NPY_NON_FINITE": [
    "error",
    "a value is not finite",
    "plux.md#a4"
  ],
  "PLX_SURFACE_EMPTY": [
    "error",
    "there are no triangles",
    "plux.md#s1"
  ],
  "PLX_SURFACE_INDEX": [
    "error",
    "triangle {triangle} names a vertex that does not exist",
    "plux.md#s1"
  ],
  "PLX_SURFACE_FLUX": [
    "error",
    "a triangle's flux is negative",
    "plux.md#s2"
  ],
  "PLX_SURFACE_OUTSIDE_SPHERE": [
    "error",
    "a vertex is {distance:.6} radii from the centre",
    "plux.md#s3"
  ],
  "PLX_SURFACE_CROWDED": [
    "error",
    "a ray meets the boxes of {count} triangles, at most {limit}; remove copies and divide long ones",
    "plux.md#s5"
  ],
  "PLX_SURFACE_FLUX_CLOSURE": [
    "warning",
    "the triangles' flux in channel {channel} is {ratio:.4} of the manifest's",
    "plux.md#s4"
  ],
  "PLX_SURFACE_FINISH": [
    "error",
    "a side of triangle {triangle} has a finish that is none of {count}",
    "plux.md#f3"
  ],
  "PLX_USD_NOT_FIRST": [
    "error",
    "the first member must be the only USD layer",
    "usd.md#u1"
  ],
  "PLX_USD_SYNTAX": [
    "error",
    "no readable layer: {what}",
    "usd.md#u2"
  ],
  "PLX_USD_TOO_COMPLEX": [
    "error",
    "over {limit} words, quotations, paths and marks",
    "usd.md#u2"
  ],
  "PLX_USD_TOO_DEEP": [
    "error",
    "prims or dictionaries nested deeper than {limit}",
    "usd.md#u2"
  ],
  "PLX_USD_NOT_ALLOWED": [
    "error",
    "{word!r} has no place in the layer of a bundle",
    "usd.md#u2"
  ],
  "PLX_USD_NO_DEFAULT_PRIM": [
    "error",
    "the layer has no default prim",
    "usd.md#u3"
  ],
  "PLX_USD_SCHEMA_MISSING": [
    "error",
    "no prim applies PureLightLuminaireAPI",
    "usd.md#u4"
  ],
  "PLX_USD_PATH": [
    "error",
    "{path!r} does not begin with ./ or leaves the folder",
    "usd.md#u5"
  ],
  "PLX_USD_PATH_DANGLING": [
    "error",
    "{path!r} is not in the bundle",
    "usd.md#u5"
  ],
  "PLX_USD_REFERENCES_LAYER": [
    "error",
    "{path!r} would compose another layer",
    "usd.md#u6"
  ],
  "PLX_USD_COMPOSITION": [
    "error",
    "the layer of a bundle may not compose: {word}",
    "usd.md#u6"
  ],
  "PLX_USD_METERS_PER_UNIT": [
    "error",
    "metersPerUnit is not 1 or upAxis not Z",
    "usd.md#u7"
  ],
  "PLX_SIDE_DIGEST_MISMATCH": [
    "warning",
    "made for another bundle: bundleDigest is {digest!r}",
    "usd.md#u8"
  ],
  "PLX_SIDE_LAYER_INVALID": [
    "warning",
    "{code} at {location}: {message}",
    "usd.md#u8"
  ],
  "PLX_GOLDEN_MISSING": [
    "error",
    "the network {network} has no golden vectors",
    "conformance.md#g1"
  ],
  "PLX_GOLDEN_SHAPE": [
    "error",
    "{count} vectors, must be 1 to {limit}",
    "conformance.md#g2"
  ],
  "PLX_GOLDEN_TOLERANCE_INVALID": [
    "error",
    "a tolerance is negative",
    "conformance.md#g3"
  ],
  "PLX_GOLDEN_TOLERANCE_LOOSE": [
    "warning",
    "a tolerance is {ratio:.3} of its value",
    "conformance.md#g3"
  ],
  "PLX_GOLDEN_COST": [
    "error",
    "the golden vectors take {size} ms of work, at most {limit}; use fewer of them",
    "conformance.md#g2"
  ],
  "PLX_GOLDEN_MISMATCH": [
    "error",
    "{count} of {total} vectors are not met by the reference evaluator (error {error:.3})",
    "conformance.md#g4"
  ],
  "PLX_GOLDEN_BROKEN": [
    "error",
    "the network fails on its golden vectors: {what}",
    "conformance.md#g4"
  ],
  "PLX_GOLDEN_RANGE": [
    "error",
    "{count} values are not {expected}",
    "conformance.md#g5"
  ],
  "PLX_GOLDEN_CHANNEL": [
    "warning",
    "{count} values are not 0 in a channel that carries no flux",
    "conformance.md#g6"
  ],
  "PLX_VALIDATOR_FAULT": [
    "error",
    "the validator failed, so the bundle counts as invalid; please report it: {what}",
    "plux.md#v1"
  ],
  "PLX_PREVIEW_INVALID": [
    "error",
    "the preview is no PNG picture",
    "plux.md#p1"
  ],
  "PLX_PREVIEW_TOO_LARGE": [
    "error",
    "the preview has {size} pixels, at most {limit} each way",
    "plux.md#p1"
  ],
  "PLX_PHOTOMETRY_INVALID": [
    "error",
    "the photometry is no IES LM-63 text",
    "plux.md#p2"
  ],
  "PLX_MEMBER_UNKNOWN": [
    "warning",
    "no use of this member is defined; it is ignored",
    "plux.md#m14"
  ],
  "PLX_MEMBER_TOO_LARGE": [
    "error",
    "{size} bytes, at most {limit}",
    "plux.md#m14"
  ]
};

export const LONGEST = 300;

export const LIMITS = {
  "file_bytes": 1073741824,
  "members": 128,
  "name_depth": 4,
  "name_part_bytes": 64,
  "manifest_bytes": 1048576,
  "json_depth": 16,
  "json_number_digits": 40,
  "network_bytes": 536870912,
  "network_structure_bytes": 2097152,
  "nodes": 4096,
  "initializers": 4096,
  "node_inputs": 256,
  "node_outputs": 1024,
  "tensor_rank": 6,
  "sample_floats": 65536,
  "sample_floats_sum": 1048576,
  "sample_macs": 16000000,
  "sample_nanoseconds": 2000000,
  "array_bytes": 67108864,
  "crowding": 1024,
  "finishes": 64,
  "vectors": 1024,
  "golden_milliseconds": 2000,
  "layer_bytes": 134217728,
  "layer_words": 10000,
  "layer_depth": 16,
  "picture_bytes": 16777216,
  "picture_pixels": 4096,
  "issues": 100
};

export const FORMAT_VERSION = "1.0";

export const UNITS = {
  "length": "m",
  "flux": "W",
  "radiance": "W/(m2 sr)",
  "color_space": "lin_rec709_scene",
  "up_axis": "Z"
};

export const MANIFEST_BOUNDS = {
  "smallest": 1e-06,
  "largest": 1000000.0,
  "faintest": 1e-30
};

export const KINDS = {
  "appearance": {
    "inputs": {
      "position": [
        3
      ],
      "normal": [
        3
      ],
      "outgoing": [
        3
      ]
    },
    "outputs": {
      "radiance": [
        3
      ]
    },
    "units": {
      "radiance": [
        0.0,
        1.0
      ]
    },
    "ranges": {
      "radiance": [
        0.0,
        null
      ]
    },
    "shining": [
      "radiance"
    ],
    "needs": [],
    "required": true,
    "ability": "be looked at, and light a room"
  },
  "transparency": {
    "inputs": {
      "position": [
        3
      ],
      "normal": [
        3
      ],
      "outgoing": [
        3
      ]
    },
    "outputs": {
      "transmittance": [
        3
      ]
    },
    "units": {
      "transmittance": [
        1.0,
        0.0
      ]
    },
    "ranges": {
      "transmittance": [
        0.0,
        1.0
      ]
    },
    "shining": [],
    "needs": [],
    "required": false,
    "ability": "be seen through"
  },
  "sampler": {
    "inputs": {
      "point": [
        3
      ],
      "u": [
        2
      ]
    },
    "outputs": {
      "toward": [
        3
      ],
      "pdf_solid_angle": []
    },
    "units": {
      "toward": [
        1.0,
        0.0
      ],
      "pdf_solid_angle": [
        0.0,
        0.0
      ]
    },
    "ranges": {
      "toward": [
        null,
        null
      ],
      "pdf_solid_angle": [
        0.0,
        null
      ]
    },
    "shining": [],
    "needs": [
      "sampler_pdf"
    ],
    "required": false,
    "ability": "sample its own light (accurate mode)"
  },
  "sampler_pdf": {
    "inputs": {
      "point": [
        3
      ],
      "toward": [
        3
      ]
    },
    "outputs": {
      "pdf_solid_angle": []
    },
    "units": {
      "pdf_solid_angle": [
        0.0,
        0.0
      ]
    },
    "ranges": {
      "pdf_solid_angle": [
        0.0,
        null
      ]
    },
    "shining": [],
    "needs": [],
    "required": false,
    "ability": ""
  },
  "fast_map": {
    "inputs": {
      "point": [
        3
      ]
    },
    "outputs": {
      "radiance_map": [
        16,
        16,
        3
      ]
    },
    "units": {
      "radiance_map": [
        0.0,
        1.0
      ]
    },
    "ranges": {
      "radiance_map": [
        0.0,
        null
      ]
    },
    "shining": [
      "radiance_map"
    ],
    "needs": [],
    "required": false,
    "ability": "light from a 16 x 16 map (fast mode)"
  }
};

export const ABILITIES = {
  "appearance": "be looked at, and light a room",
  "transparency": "be seen through",
  "sampler": "sample its own light (accurate mode)",
  "fast_map": "light from a 16 x 16 map (fast mode)"
};

export const SURFACE = {
  "slack": 1e-05,
  "closure": 0.01
};

export const FINISHES = {
  "member": "surface/finish.npy",
  "none": 255,
  "slack": 1e-06,
  "least_ior": 1.0,
  "largest_ior": 4.0,
  "largest_exponent": 1000000.0
};

export const TIERS = {
  "small": 4,
  "map_cells": 256,
  "known": {
    "portable": {
      "name": "portable",
      "macs": 5120,
      "map_macs": 16384,
      "floats": 16384,
      "multiple": 16,
      "constants": 4194304
    }
  }
};

export const VERDICT = {
  "largest": 1000000000000.0,
  "signed": [
    "above",
    "around",
    "below",
    "by_heart",
    "detail",
    "haze",
    "mean",
    "pattern"
  ],
  "groups": {
    "Verdict": [
      [
        "photons",
        null,
        false
      ],
      [
        "accurate",
        "Mode",
        false
      ],
      [
        "share",
        "Zones",
        false
      ],
      [
        "pattern",
        null,
        false
      ],
      [
        "fast",
        "Mode",
        true
      ],
      [
        "near",
        "Places",
        true
      ],
      [
        "look",
        "Look",
        true
      ],
      [
        "grain",
        null,
        true
      ],
      [
        "by_heart",
        null,
        true
      ]
    ],
    "Places": [
      [
        "within",
        null,
        false
      ],
      [
        "noise",
        null,
        false
      ],
      [
        "mean",
        null,
        false
      ]
    ],
    "Zones": [
      [
        "below",
        null,
        false
      ],
      [
        "around",
        null,
        false
      ],
      [
        "above",
        null,
        false
      ]
    ],
    "Mode": [
      [
        "within",
        null,
        false
      ],
      [
        "noise",
        null,
        false
      ],
      [
        "mean",
        null,
        false
      ],
      [
        "pattern",
        null,
        false
      ],
      [
        "zones",
        "Zones",
        false
      ]
    ],
    "Look": [
      [
        "size",
        null,
        false
      ],
      [
        "detail",
        null,
        false
      ],
      [
        "detail_noise",
        null,
        false
      ],
      [
        "haze",
        null,
        false
      ],
      [
        "error",
        null,
        false
      ],
      [
        "noise",
        null,
        false
      ]
    ]
  },
  "bars": {
    "good": 0.05,
    "fair": 0.15,
    "resolved": 0.5,
    "kept": 0.8,
    "clear": 0.26,
    "foggy": 0.41,
    "smooth": 0.1,
    "alike": 1.2,
    "pattern": 0.05,
    "zone": 0.03,
    "faint": 0.001,
    "grain": 16.0,
    "by_heart": 0.05
  },
  "larger": {
    "sketch": "draft",
    "draft": "standard",
    "standard": "paper"
  },
  "where": {
    "below": "below it",
    "around": "beside it",
    "above": "above it"
  }
};

export const SUMMARY = {
  "fold": 100,
  "finishes": 6,
  "metal": 0.5
};

export const LOOSE = 0.2;

export const PROFILE = {
  "ir_version": 10,
  "opset": 18,
  "rows": "N"
};

export const FLAGS = [
  "allowzero",
  "exclusive",
  "fmod",
  "keepdims",
  "noop_with_empty_axes",
  "reverse",
  "transA",
  "transB"
];

export const OPERATORS = {
  "Abs": [
    1,
    1,
    []
  ],
  "Add": [
    2,
    2,
    []
  ],
  "And": [
    2,
    2,
    []
  ],
  "Asin": [
    1,
    1,
    []
  ],
  "Atan": [
    1,
    1,
    []
  ],
  "Cast": [
    1,
    1,
    [
      "to"
    ]
  ],
  "Clip": [
    1,
    3,
    []
  ],
  "Concat": [
    1,
    256,
    [
      "axis"
    ]
  ],
  "Cos": [
    1,
    1,
    []
  ],
  "CumSum": [
    2,
    2,
    [
      "exclusive",
      "reverse"
    ]
  ],
  "Div": [
    2,
    2,
    []
  ],
  "Equal": [
    2,
    2,
    []
  ],
  "Exp": [
    1,
    1,
    []
  ],
  "Floor": [
    1,
    1,
    []
  ],
  "Gather": [
    2,
    2,
    [
      "axis"
    ]
  ],
  "GatherElements": [
    2,
    2,
    [
      "axis"
    ]
  ],
  "Gemm": [
    3,
    3,
    [
      "alpha",
      "beta",
      "transA",
      "transB"
    ]
  ],
  "Greater": [
    2,
    2,
    []
  ],
  "GreaterOrEqual": [
    2,
    2,
    []
  ],
  "Identity": [
    1,
    1,
    []
  ],
  "Less": [
    2,
    2,
    []
  ],
  "LessOrEqual": [
    2,
    2,
    []
  ],
  "Log": [
    1,
    1,
    []
  ],
  "MatMul": [
    2,
    2,
    []
  ],
  "Max": [
    1,
    256,
    []
  ],
  "Min": [
    1,
    256,
    []
  ],
  "Mod": [
    2,
    2,
    [
      "fmod"
    ]
  ],
  "Mul": [
    2,
    2,
    []
  ],
  "Neg": [
    1,
    1,
    []
  ],
  "Not": [
    1,
    1,
    []
  ],
  "Or": [
    2,
    2,
    []
  ],
  "Reciprocal": [
    1,
    1,
    []
  ],
  "ReduceMax": [
    2,
    2,
    [
      "keepdims",
      "noop_with_empty_axes"
    ]
  ],
  "ReduceSum": [
    2,
    2,
    [
      "keepdims",
      "noop_with_empty_axes"
    ]
  ],
  "Relu": [
    1,
    1,
    []
  ],
  "Reshape": [
    2,
    2,
    [
      "allowzero"
    ]
  ],
  "Sigmoid": [
    1,
    1,
    []
  ],
  "Sign": [
    1,
    1,
    []
  ],
  "Sin": [
    1,
    1,
    []
  ],
  "Slice": [
    4,
    5,
    []
  ],
  "Softmax": [
    1,
    1,
    [
      "axis"
    ]
  ],
  "Split": [
    2,
    2,
    [
      "axis"
    ]
  ],
  "Sqrt": [
    1,
    1,
    []
  ],
  "Squeeze": [
    2,
    2,
    []
  ],
  "Sub": [
    2,
    2,
    []
  ],
  "Transpose": [
    1,
    1,
    [
      "perm"
    ]
  ],
  "Unsqueeze": [
    2,
    2,
    []
  ],
  "Where": [
    3,
    3,
    []
  ]
};

export const COST = {
  "call": 100.0,
  "name": 20.0,
  "product": 0.1,
  "element": {
    "Concat": 1.0,
    "Identity": 1.0,
    "Reshape": 1.0,
    "Slice": 1.0,
    "Split": 1.0,
    "Squeeze": 1.0,
    "Transpose": 1.0,
    "Unsqueeze": 1.0,
    "Abs": 2.0,
    "Add": 2.0,
    "And": 2.0,
    "Cast": 2.0,
    "Clip": 2.0,
    "Div": 2.0,
    "Equal": 2.0,
    "Floor": 2.0,
    "Greater": 2.0,
    "GreaterOrEqual": 2.0,
    "Less": 2.0,
    "LessOrEqual": 2.0,
    "Max": 2.0,
    "Min": 2.0,
    "Mul": 2.0,
    "Neg": 2.0,
    "Not": 2.0,
    "Or": 2.0,
    "Reciprocal": 2.0,
    "Relu": 2.0,
    "Sign": 2.0,
    "Sqrt": 2.0,
    "Sub": 2.0,
    "Where": 2.0,
    "Exp": 4.0,
    "Log": 4.0,
    "Sigmoid": 8.0,
    "Asin": 15.0,
    "Atan": 15.0,
    "Cos": 15.0,
    "Sin": 15.0,
    "CumSum": 8.0,
    "ReduceMax": 8.0,
    "ReduceSum": 8.0,
    "Softmax": 20.0,
    "Gather": 10.0,
    "GatherElements": 10.0
  },
  "integer_division": 15.0,
  "large_table": 262144,
  "distant": 25.0,
  "float_remainder": 100.0,
  "folding": [
    "CumSum",
    "ReduceMax",
    "ReduceSum",
    "Softmax"
  ],
  "combining": [
    "Max",
    "Min"
  ]
};

export const USD = {
  "schema": "PureLightLuminaireAPI",
  "endings": [
    ".usd",
    ".usda",
    ".usdc",
    ".usdz"
  ],
  "brackets": 4,
  "types": [
    "asset",
    "bool",
    "color3d",
    "color3f",
    "color3h",
    "color4d",
    "color4f",
    "color4h",
    "double",
    "double2",
    "double3",
    "double4",
    "float",
    "float2",
    "float3",
    "float4",
    "frame4d",
    "half",
    "half2",
    "half3",
    "half4",
    "int",
    "int2",
    "int3",
    "int4",
    "int64",
    "matrix2d",
    "matrix3d",
    "matrix4d",
    "normal3d",
    "normal3f",
    "normal3h",
    "point3d",
    "point3f",
    "point3h",
    "quatd",
    "quatf",
    "quath",
    "string",
    "texCoord2d",
    "texCoord2f",
    "texCoord2h",
    "texCoord3d",
    "texCoord3f",
    "texCoord3h",
    "timecode",
    "token",
    "uchar",
    "uint",
    "uint64",
    "vector3d",
    "vector3f",
    "vector3h"
  ],
  "layer_fields": [
    "customLayerData",
    "defaultPrim",
    "doc",
    "endTimeCode",
    "framesPerSecond",
    "kilogramsPerUnit",
    "metersPerUnit",
    "startTimeCode",
    "timeCodesPerSecond",
    "upAxis"
  ],
  "prim_fields": [
    "active",
    "apiSchemas",
    "assetInfo",
    "customData",
    "displayName",
    "doc",
    "hidden",
    "kind"
  ],
  "property_fields": [
    "allowedTokens",
    "colorSpace",
    "customData",
    "displayGroup",
    "displayName",
    "doc",
    "elementSize",
    "hidden",
    "interpolation"
  ],
  "composing": [
    "subLayers",
    "references",
    "payload",
    "inherits",
    "specializes",
    "variant",
    "clips",
    "relocates",
    "expressionVariables",
    "colorConfiguration"
  ],
  "specifiers": [
    "def",
    "over",
    "class"
  ]
};

export const LUMINANCE = [
  0.2126,
  0.7152,
  0.0722
];

export const LUMENS_PER_WATT = 683.0;
