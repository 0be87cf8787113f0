/// What applications ask and are told (common/request) as JSON: made from the descriptions, so that a new request needs
/// no line here.
///
///     {"id": 7, "request": NAME, "fields": {"node": 17, "translation": [1, 2, 3]}}
///     {"id": 7, "answer": "Committed", "fields": {"sequence": 12, …}}
///     {"id": 7, "error": {"code": "bad_input", "message": "…", "field": "translation[0]"}}
///     {"notice": "Frame", "fields": {…}}
///
/// Where `"binaries": N` stands in such a text, N binary frames follow it, and `{"binary": 0}` means the first of them.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "common/base/Blob.h"
#include "common/json/Json.h"
#include "common/request/Requests.h"

namespace tessera {

/// A request, ready to be sent.
struct ReadRequest {
    ApplicationRequest request;
    std::vector<Blob> arrays;  ///< that go before it
};

/// Objects by names that are neither numbers nor "$0": paths.
class ObjectNames {
public:
    /// A name that is not known yet is `wanted` from now on, and stands for the root meanwhile. `path`: of the member
    /// that says it. kLimit: it is too long, or too many are wanted.
    [[nodiscard]] Expected<ObjectId> find(const std::string& name, const std::string& path);
    void know(const std::string& name, ObjectId id) { known_[name] = id; }
    /// Those that were asked for and are not known, as many as a server is asked for at once; and the member that was
    /// the first to name each.
    [[nodiscard]] const std::map<std::string, std::string>& wanted() const { return wanted_; }
    void forgetWanted() { wanted_.clear(); }

private:
    std::map<std::string, ObjectId> known_;
    std::map<std::string, std::string> wanted_;
};

/// `fields`: an object, or null where nothing is said. Whatever is wrong is refused with its field. Where `names` wants
/// any afterwards, what was read does not count: who has found them reads again.
[[nodiscard]] ApiExpected<ReadRequest> readRequest(std::string_view name, const Json& fields,
                                                   std::span<const ByteSlice> binaries, ObjectNames& names);

/// A name, and fields; bytes go to `binaries`.
struct SaidJson {
    std::string_view name;
    Json fields;
};
[[nodiscard]] SaidJson answerJson(const ApplicationAnswer& answer, Binaries& binaries);
[[nodiscard]] SaidJson noticeJson(const ApplicationNotice& notice, Binaries& binaries);

}  // namespace tessera
