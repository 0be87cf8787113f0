/// Lists of changes as JSON and back:
///
///     {"created": [{"id": "$0", "type": "Node"}],
///      "placed": [{"node": "$0", "parent": 1, "index": 2}],
///      "set": [{"type": "Transform", "field": "translation", "ids": [17, 18], "values": [[1, 2, 3], [4, 5, 6]]}],
///      "parts": [{"object": 19, "type": "Geometry", "field": "positions", "offset": 0, "bytes": {"binary": 0}}],
///      "destroyed": [20]}
///
/// In the order in which they act. `ids` and `values` may be binaries: ids as uint64, numbers as the field has them
/// (float, double, int64), bools as bytes, little-endian, one row behind the other. Values: numbers, arrays of them,
/// words (of flags with commas between), texts, true and false, ids or null, arrays of ids; of an array `{"binary":N}`,
/// null for none, or what is told of one: `{"blob":"32 hexadecimal digits","bytes":N}`.
#pragma once

#include <span>

#include "common/base/Blob.h"
#include "common/change/ChangeList.h"
#include "common/json/JsonValues.h"

namespace tessera {

struct FieldInfo;

/// A value by itself: whole numbers as numbers.
[[nodiscard]] Json valueJson(const FieldValue& value);
/// A field's value, as in "values" above: words where the number has one.
[[nodiscard]] Json valueJson(const FieldInfo& field, const FieldValue& value);

/// A list. Types and fields that are not in the table are left out: there are none in what this server has made.
[[nodiscard]] Json changesJson(const ChangeList& list);
/// An encoded one; no bytes: null.
[[nodiscard]] Json changesJson(const ByteSlice& encoded);

/// Encoded, as a proposal has it. Form, table of types and bounds of fields are checked here, and refused with the
/// place; what the scene says to it is the server's to find. Appends the arrays that came as binaries. Of a fault no
/// bytes.
[[nodiscard]] ByteSlice changesIn(JsonPlace& place, const Json& json, std::span<const ByteSlice> binaries,
                                  const NamedObject& named, std::vector<Blob>& arrays);

}  // namespace tessera
