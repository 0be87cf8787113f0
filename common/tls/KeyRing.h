/// Keys that are renewed and revoked while a program runs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "common/base/Turn.h"
#include "common/tls/KeyFolder.h"

namespace tessera {

/// The keys of a folder as they are now. One thread inside, which sleeps until a file of the folder changes. `current`
/// may be called from any thread.
///
/// Files that cannot be read change nothing: the keys before are kept, and `onWords` says why.
class KeyRing {
public:
    using Read = std::function<Expected<TlsKeys>()>;

    /// Errors: what is wrong with the keys now. `onChange` and `onWords` are called on the thread inside.
    [[nodiscard]] static Expected<std::unique_ptr<KeyRing>> open(const std::string& folder, Read read);
    /// Without a folder: keys that stay as they are.
    [[nodiscard]] static Expected<std::unique_ptr<KeyRing>> of(TlsKeys keys);
    ~KeyRing();

    /// From now on, until `rest`. Once. `onWords`: what people should know: a fault in the files; and of a server, at
    /// first, once a day and after each change, which keys end soon.
    void watch(std::function<void()> onChange, std::function<void(const std::string&)> onWords);
    /// Nobody is told of anything afterwards.
    void rest();
    [[nodiscard]] std::shared_ptr<const TlsContext> current() const;

private:
    KeyRing() = default;
    void run();
    void reload();
    void sayEnds() const;

    std::string folder_;
    Read read_;
    std::function<void()> onChange_;
    std::function<void(const std::string&)> onWords_;
    mutable Turn turn_;
    std::shared_ptr<const TlsContext> current_;
    int notices_ = -1, stop_ = -1;  ///< inotify; an eventfd
    std::thread thread_;
};

/// The keys as they are whenever it is asked, from any thread. Empty: there are none.
using CurrentKeys = std::function<std::shared_ptr<const TlsContext>()>;

/// `folder`: as --keys names it. Errors: what is wrong with them now; later faults leave them as they are.
[[nodiscard]] Expected<CurrentKeys> keysThatStay(TlsKeys keys);
[[nodiscard]] Expected<CurrentKeys> keysOfHost(const std::string& folder, const std::string& name);
/// `place`: a folder in which one person's key is, or the file of that key.
[[nodiscard]] Expected<CurrentKeys> keysOfPerson(const std::string& place);

}  // namespace tessera
