#include "client/ctl/AccessVerbs.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/ctl/TextTable.h"
#include "common/access/LocalWalls.h"

namespace tessera {

Expected<Answer> run(Application& application, const verb::Who&) {
    const Expected<answer::Identity> who = application.whoAmI();
    if (!who) return tl::unexpected(who.error());
    return Answer{fmt::format("{}, {} of the wall {}\n", who->name, nameOf(who->role), application.wall().name),
                  {{"name", who->name}, {"role", nameOf(who->role)}, {"wall", application.wall().name}},
                  {}};
}

Expected<Answer> run(Application& application, const verb::People&) {
    const Expected<answer::People> told = application.people();
    if (!told) return tl::unexpected(told.error());
    TextTable table({"NAME", "ROLE", "PROGRAM", "FOR"});
    Json people = Json::array();
    for (const answer::Person& person : told->people) {
        table.add({person.name.empty() ? "-" : person.name, std::string(nameOf(person.role)),
                   person.you ? person.program + " (you)" : person.program, fmt::format("{:.0f} s", person.seconds)});
        people.push_back({{"name", person.name},
                          {"role", nameOf(person.role)},
                          {"program", person.program},
                          {"seconds", person.seconds},
                          {"you", person.you}});
    }
    Answer answer{table.text(), {{"people", std::move(people)}, {"left_out", told->leftOut}}, {}};
    if (told->leftOut > 0) answer.text += fmt::format("and {} more\n", told->leftOut);
    return answer;
}

Expected<Answer> linkOf(const CommandLine& line, const verb::Link& wanted) {
    const Expected<ServerMeant> meant = serverMeant(line.server);
    if (!meant) return tl::unexpected(meant.error());
    const Address& server = meant->address;
    const Expected<std::vector<LocalWall>> walls = localWalls();
    if (!walls) return tl::unexpected(walls.error());
    const auto same = [&](const LocalWall& wall) {
        return wall.server.port == server.port && (wall.server.host == server.host || server.isLoopback());
    };
    const auto wall = std::ranges::find_if(*walls, same);
    if (wall == walls->end())
        return fail(ErrorCode::kNotFound,
                    fmt::format("link: no server of this user listens at {} on this machine", toString(server)));
    if (!wall->console)
        return fail(ErrorCode::kNotFound, fmt::format("link: the server at {} has no console", toString(server)));
    const bool sealed = !wall->authority.empty();
    const std::string link = fmt::format("{}://{}/?token={}{}", sealed ? "https" : "http", toString(*wall->console),
                                         wall->tokens.of(wanted.role), sealed ? "&authority=" + wall->authority : "");
    return Answer{link + "\n", {{"link", link}, {"role", nameOf(wanted.role)}}, {}};
}

}  // namespace tessera
