/// A library that is looked for when it is needed: two that give OpenGL must never meet in one process, and who draws
/// with one need not have the other.
#pragma once

#include <string>

#include "common/base/Error.h"

namespace tessera {

/// Stays loaded until the process ends: drivers keep threads and handlers of their own.
class SharedLibrary {
public:
    /// By its name for the dynamic linker. kUnsupported: it is not there, or cannot be loaded; names the Debian package
    /// that has it.
    [[nodiscard]] static Expected<SharedLibrary> open(const std::string& name, const std::string& package);
    /// Its function of this name, nullptr where it has none. `Function`: a pointer to one.
    template <typename Function>
    [[nodiscard]] Function find(const char* function) const {
        return reinterpret_cast<Function>(address(function));
    }

private:
    explicit SharedLibrary(void* handle) : handle_(handle) {}
    [[nodiscard]] void* address(const char* function) const;
    void* handle_;
};

}  // namespace tessera
