#include "client/ctl/RequestsText.h"

#include "client/ctl/TextTable.h"
#include "common/request/Catalogue.h"

namespace tessera {

std::string requestsText() {
    TextTable table({"NUMBER", "REQUEST", "ROLE", "CHANGES", "ANSWER", "HELP"});
    for (const RequestText& request : allRequests()) {
        const RequestInfo& info = request.info;
        table.add({std::to_string(info.number), std::string(info.name), std::string(nameOf(info.role)),
                   info.changes == Changes::kNothing ? "-" : std::string(nameOf(info.changes)),
                   std::string(request.answer) + (info.answered == Answered::kLater ? ", later" : ""),
                   std::string(info.help)});
    }
    return table.text();
}

}  // namespace tessera
