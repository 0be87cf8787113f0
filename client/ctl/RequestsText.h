/// All requests that applications may say, as their descriptions have it: `tessera-ctl requests`.
#pragma once

#include <string>

namespace tessera {

/// A request per line; for people.
[[nodiscard]] std::string requestsText();
/// {"protocol","requests":[REQUEST],"answers":[TOLD],"notices":[TOLD],"former":[numbers],"wire":WIRE} (WireText.h).
/// REQUEST: {"number","name","role","changes","answer","stays_open","brings_arrays","help","fields":[FIELD]}.
/// TOLD: {"number","name","help","fields":[FIELD]}. FIELD: {"name","type"} with whatever says something of "number" (of
/// the head), "unit", "least", "greatest", "or", "bounds", "words", "help", "when", "optional", "many", "part", "rest"
/// (all parts that are left), "bytes" and "count" (in a record), "fields" (of a value or a record).
[[nodiscard]] std::string requestsJson();

}  // namespace tessera
