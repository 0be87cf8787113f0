#include "server/door/AskInJson.h"

#include <nlohmann/json.hpp>

#include "common/json/RequestJson.h"

namespace tessera {
namespace {

using AnsweredAsItCame = std::function<void(const ApiExpected<ByteSlice>&)>;

struct Asking {
    std::weak_ptr<DoorLink> link;
    std::string request;
    std::shared_ptr<const Json> fields;
    std::vector<ByteSlice> binaries;
    ObjectNames names;
    AnsweredAsItCame answered;
    std::string from;
};

tl::unexpected<ApiError> withoutField(const Error& error) {
    return tl::unexpected(ApiError{error.code, error.message});
}

void ask(const std::shared_ptr<Asking>& asking);

/// Objects by the names that the request speaks of.
void lookUp(DoorLink& link, const std::shared_ptr<Asking>& asking) {
    std::vector<std::string> names, members;
    for (const auto& [name, member] : asking->names.wanted()) {
        names.push_back(name);
        members.push_back(member);
    }
    asking->names.forgetWanted();
    link.ask(ObjectsQuestion{{.names = names, .paths = false}}, {},
             [asking, names, members](const Expected<ApplicationAnswer>& answer) {
                 const auto* objects = answer ? std::get_if<answer::Objects>(&*answer) : nullptr;
                 if (!answer) return asking->answered(withoutField(answer.error()));
                 if (objects == nullptr || objects->objects.size() != names.size())
                     return asking->answered(withoutField({ErrorCode::kFailed, "objects were asked for; none came"}));
                 for (std::size_t i = 0; i < names.size(); ++i) {
                     const ObjectInfo& object = objects->objects[i];
                     if (!object.id)
                         return asking->answered(tl::unexpected(
                             ApiError{ErrorCode::kNotFound, members[i] + ": " + object.path, members[i]}));
                     asking->names.know(names[i], object.id);
                 }
                 ask(asking);
             });
}

void ask(const std::shared_ptr<Asking>& asking) {
    const std::shared_ptr<DoorLink> link = asking->link.lock();
    if (!link) return;
    const Json nothing;
    const ApiExpected<ReadRequest> read =
        readRequest(asking->request, asking->fields ? *asking->fields : nothing, asking->binaries, asking->names);
    if (!read) return asking->answered(tl::unexpected(read.error()));
    if (!asking->names.wanted().empty()) return lookUp(*link, asking);
    link->askAsItComes(
        read->request, read->arrays,
        [asking](const Expected<ByteSlice>& answer) {
            asking->answered(answer ? ApiExpected<ByteSlice>(*answer) : withoutField(answer.error()));
        },
        asking->from);
}

}  // namespace

void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, AnsweredAsItCame answered, const std::string& from) {
    auto asking = std::make_shared<Asking>();
    asking->link = link.weak_from_this();
    asking->request = request;
    asking->fields = std::move(fields);
    asking->binaries = std::move(binaries);
    asking->answered = std::move(answered);
    asking->from = from;
    ask(asking);
}

}  // namespace tessera
