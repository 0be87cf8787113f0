/// Keys that are renewed and revoked while a program runs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "common/base/Turn.h"
#include "common/tls/KeyFolder.h"

namespace tessera {

/// The keys of a folder as they are now. One thread inside, which looks four times a second
/// whether a file of the folder, or the folder, is another one. `current`
/// may be called from any thread.
///
/// Files that cannot be read change nothing: the keys before are kept, and `onWords` says why. A server's then still
/// takes what can be read of what has been revoked (KeyFolder::takeRevoked).
class KeyRing {
public:
    using Read = std::function<Expected<TlsKeys>()>;

    /// Errors: what is wrong with the keys now. `onChange` and `onWords` are called on the thread inside.
    [[nodiscard]] static Expected<std::unique_ptr<KeyRing>> open(const std::string& folder, Read read);
    ~KeyRing();

    /// From now on, until `rest`. Once. `onChange`: they are others, or a second is over, in which one may have ended.
    /// `onWords`: what people should know: a fault in the files; and of a server, at
    /// first, once a day and after each change, which keys end soon, and which tokens let nobody in for their panel is
    /// lost.
    void watch(std::function<void()> onChange, std::function<void(const std::string&)> onWords);
    /// Nobody is told of anything afterwards.
    void rest();
    [[nodiscard]] std::shared_ptr<const TlsContext> current() const;

private:
    KeyRing() = default;
    void run();
    void reload();
    void stay(const Error& why);
    void put(std::shared_ptr<const TlsContext> made);
    [[nodiscard]] std::string signature() const;
    void sayFaults() const;

    std::string folder_;
    Read read_;
    std::function<void()> onChange_;
    std::function<void(const std::string&)> onWords_;
    mutable Turn turn_;
    std::shared_ptr<const TlsContext> current_;
    TlsKeys keys_;      ///< that it was made of
    std::string seen_;  ///< how the files were when they were last read
    std::string said_;  ///< the last fault
    int stop_ = -1;     ///< an eventfd
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
