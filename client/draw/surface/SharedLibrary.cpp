#include "client/draw/surface/SharedLibrary.h"

#include <dlfcn.h>

namespace tessera {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kOwnFirst = 0;  // what watches memory must be found before the system's
#else
constexpr int kOwnFirst = RTLD_DEEPBIND;
#endif

}  // namespace

Expected<SharedLibrary> SharedLibrary::open(const std::string& name, const std::string& package) {
    // Its names are its own: what another library of OpenGL exports is not taken for them. It looks for those that it
    // needs in its own libraries first: LLVM, which Mesa brings, looks for 20,000, and would look through all of this
    // program's before.
    if (void* const handle = ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | kOwnFirst)) return SharedLibrary(handle);
    const char* const why = ::dlerror();
    return fail(ErrorCode::kUnsupported,
                std::string(why ? why : name + " cannot be loaded") + " (Debian's " + package + " has it)");
}

void* SharedLibrary::address(const char* function) const {
    return ::dlsym(handle_, function);
}

}  // namespace tessera
