/// What a person, or a program of theirs, may do at a wall.
#pragma once

#include <cstdint>
#include <string_view>

namespace tessera {

/// Each may do what those before it may.
enum class Role : std::uint8_t {
    kViewer,    ///< looks and asks
    kEditor,    ///< changes the scene and the view
    kOperator,  ///< shows, budgets, files on the server's disk
};
/// "viewer", "editor", "operator"
[[nodiscard]] constexpr std::string_view nameOf(Role role) {
    return role == Role::kViewer ? "viewer" : role == Role::kEditor ? "editor" : "operator";
}

}  // namespace tessera
