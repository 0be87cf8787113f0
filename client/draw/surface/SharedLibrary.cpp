#include "client/draw/surface/SharedLibrary.h"

#include <dlfcn.h>

namespace tessera {

Expected<SharedLibrary> SharedLibrary::open(const std::string& name, const std::string& package) {
    // Its names are its own: what another library of OpenGL exports is not taken for them.
    if (void* const handle = ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL)) return SharedLibrary(handle);
    const char* const why = ::dlerror();
    return fail(ErrorCode::kUnsupported,
                std::string(why ? why : name + " cannot be loaded") + " (Debian's " + package + " has it)");
}

void* SharedLibrary::address(const char* function) const {
    return ::dlsym(handle_, function);
}

}  // namespace tessera
