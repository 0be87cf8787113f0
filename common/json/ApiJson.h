/// All that can be said and held, as data: requests, answers, notices, types. `GET /api` and `tessera-ctl … --json`
/// print it.
#pragma once

#include "common/json/Json.h"

namespace tessera {

struct FieldInfo;

/// Raised where a program that keeps to the rules of `GET /api` would no longer be understood.
inline constexpr int kApiVersion = 1;

/// {"protocol","requests":[REQUEST],"answers":[TOLD],"notices":[TOLD],"former":[numbers]}.
/// REQUEST: {"number","name","role","changes","answer","stays_open","brings_arrays","help","fields":[FIELD]}.
/// TOLD: {"number","name","help","fields":[FIELD]}. FIELD: {"name","type"} with whatever says something of "number" (of
/// the head), "holds" (of bytes), "unit", "least", "greatest", "or", "bounds", "words", "help", "when", "optional",
/// "many", "part", "rest" (all parts that are left), "bytes" and "count" (in a record), "fields" (of a value or a
/// record).
[[nodiscard]] Json requestsJson();
/// {"schema": hash of types and fields,
/// "types":[{"name","number","core","fields":[{"name","number","kind","width","unit","to","default","least","greatest",
/// "words","written_by","instead"}]}]}. "written_by": "server" alone, who refuses it of others, or writes over it;
/// "instead": what a person does.
[[nodiscard]] Json typesJson();
/// What a reference leads to, for people: a type's name, "any core", "anything".
[[nodiscard]] std::string_view targetName(const FieldInfo& field);
/// Both, with the version of the API and the rules by which it changes.
[[nodiscard]] Json apiJson();

}  // namespace tessera
