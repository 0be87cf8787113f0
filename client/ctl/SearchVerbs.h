/// What is there by name, and copies of it.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// Paths are printed page by page, as they come; as JSON they are one answer.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Find& find, bool json, const Print& print);

/// All fields of an object, and of its core where it is a node; or one of them.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Get& get);
/// `get NODE bounds`, which no field is called: the box around all that can be drawn there and below, for which the
/// application has to follow the scene with its arrays.
[[nodiscard]] inline bool asksForBounds(const verb::Get& get) {
    return get.field == "bounds";
}

/// Names to numbers: a word of the share list is a type where there is one of that name, else a node's path or an
/// object's "#17".
[[nodiscard]] Expected<CloneWish> cloneWish(Application& application, const verb::Clone& clone);

}  // namespace tessera
