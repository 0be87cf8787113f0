/// What every client of the native link has to know beside requests: messages, bounds and codes. Of `tessera-ctl
/// requests --json`.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace tessera {

/// {"schema": hash of types and fields, 16 hexadecimal digits, "header":{…}, "errors":[words by number],
/// "limits":{name: number}, "messages":[MESSAGE]}. MESSAGE:
/// {"number","name","from","to","on","when","most_bytes","fields":[{"name","form","number"}]}: `form` is a FieldForm;
/// "number" that of the first field of the head (a "hash" takes two, a "blob" three, a "list" two).
[[nodiscard]] nlohmann::ordered_json wireJson();

}  // namespace tessera
