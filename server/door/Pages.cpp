#include "server/door/Pages.h"

#include <fmt/format.h>

#include "common/request/Catalogue.h"
#include "server/door/PageFiles.h"

namespace tessera {
namespace {

std::string page(std::string_view title, std::string_view body) {
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width\">"
        "<title>{0}</title><link rel=\"stylesheet\" "
        "href=\"/style.css\"></head>\n<body><h1>{0}</h1>\n{1}</body></html>\n",
        escaped(title), body);
}

/// Those of a member that has members itself stand below it, behind its name.
std::string rowsOf(const std::vector<MemberText>& members, const std::string& within) {
    std::string rows;
    for (const MemberText& member : members) {
        if (member.isRest || member.name.empty()) continue;
        std::string type = member.holds == Holds::kChanges ? "changes" : member.type;
        if (member.many) type = "array of " + type;
        std::string about(member.help);
        if (!member.words.empty()) {
            about += about.empty() ? "one of" : "; one of";
            for (const std::string_view word : member.words) about += fmt::format(" {}", word);
        }
        for (const std::string& more : {member.bounds, member.when})
            if (!more.empty()) about += (about.empty() ? "" : "; ") + more;
        const std::string name = fmt::format("{}{}", within, member.name);
        rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", escaped(name), escaped(type),
                            escaped(member.unit), escaped(about));
        rows += rowsOf(member.members, name + (member.many ? "[]." : "."));
    }
    return rows;
}

std::string membersTable(const std::vector<MemberText>& members) {
    if (members.empty()) return "<p>No fields.</p>\n";
    return "<table><tr><th>field</th><th>type</th><th>unit</th><th>help</th></tr>\n" + rowsOf(members, {}) +
           "</table>\n";
}

HttpAnswer documentOf(std::string_view name) {
    for (const PageFile& file : pageFiles())
        if (file.name == name) return {.type = "text/html; charset=utf-8", .body = std::string(file.text)};
    return {.status = 404, .body = {}};
}

}  // namespace

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

HttpAnswer consolePage() {
    return documentOf("index.html");
}

HttpAnswer panelPage() {
    return documentOf("panel.html");
}

std::optional<HttpAnswer> consoleFile(std::string_view name) {
    const std::string_view type = name.ends_with(".js")    ? "text/javascript; charset=utf-8"
                                  : name.ends_with(".css") ? "text/css; charset=utf-8"
                                                           : "";
    if (type.empty()) return std::nullopt;
    for (const PageFile& file : pageFiles())
        if (file.name == name) return HttpAnswer{.type = std::string(type), .body = std::string(file.text)};
    return std::nullopt;
}

HttpAnswer tokenPage() {
    return {.status = 401,
            .type = "text/html; charset=utf-8",
            .body = page(
                "Tessera",
                "<p>This wall asks for a token. The server prints a link with it when it starts.</p>\n"
                "<form action=\"/\" method=\"get\"><label>Token <input name=\"token\" autocomplete=\"off\"></label> "
                "<button>Come in</button></form>\n<script type=\"module\" src=\"/page/return.js\"></script>\n"),
            .fields = {{"WWW-Authenticate", "Bearer"}}};
}

HttpAnswer apiPage(const std::string& wall) {
    std::string body =
        "<p>Each request is said to <code>/socket</code>, a WebSocket, as "
        "<code>{\"id\":1,\"request\":\"NAME\",\"fields\":{}}</code>, or as a POST of its fields to "
        "<code>/api/NAME</code>, with its Content-Length. "
        "<code>/api</code> has all of this as data, and the types of a scene; <code>/metrics</code> has figures. "
        "<code>/wall.png</code> is each pixel of the wall, <code>/scene.tsc</code> and <code>/scene.tsct</code> are "
        "the "
        "scene as it is; <code>PUT /upload/NAME</code> brings a file, and tells the path by which it is loaded. "
        "All of these want the token as <code>Authorization: Bearer</code>, the socket also as "
        "<code>?token=</code>. Objects are said by their numbers, or by text: <code>/hall/crane</code>, "
        "<code>#17</code>. Arrays and pictures are binary frames behind a text that counts them: "
        "<code>\"binaries\":2</code>, and <code>{\"binary\":0}</code> where the first belongs. A socket that is "
        "opened with <code>changes=1</code> is told each list of changes. An answer says in <code>sequence</code> "
        "as of which list it is: later ones may have been told before it.</p>\n";
    for (const RequestText& request : allRequests())
        body += fmt::format(
            "<h2 id=\"{0}\">{0}</h2>\n<p>{1}. <b>{2}</b>; changes {3}; answered by <a "
            "href=\"#{4}\">{4}</a>{7}.</p>\n{5}"
            "<pre>{{\"id\":1,\"request\":\"{0}\",\"fields\":{6}}}</pre>\n",
            request.info.name, escaped(request.info.help), nameOf(request.info.role), nameOf(request.info.changes),
            request.answer, membersTable(request.members), escaped(request.info.example),
            request.info.ownLink ? "; at /socket alone" : "");
    body += "<h1>Answers</h1>\n";
    for (const ToldText& told : allAnswers())
        body += fmt::format("<h2 id=\"{0}\">{0}</h2>\n<p>{1}.</p>\n{2}", told.info.name, escaped(told.info.help),
                            membersTable(told.members));
    body += "<h1>Notices</h1>\n";
    for (const ToldText& told : allNotices())
        if (told.info.answer != 0)
            body += fmt::format("<p><a href=\"#{0}\">{0}</a>, as the answer of that name.</p>\n", told.info.name);
        else
            body += fmt::format("<h2 id=\"{0}\">{0}</h2>\n<p>{1}.</p>\n{2}", told.info.name, escaped(told.info.help),
                                membersTable(told.members));
    return {.type = "text/html; charset=utf-8", .body = page("Tessera: " + wall, body)};
}

HttpAnswer stylePage() {
    return {.type = "text/css; charset=utf-8",
            .body =
                "body{margin:2rem auto;max-width:60rem;padding:0 1rem;background:#14171a;color:#e8eaed;font:1rem/1.5 "
                "sans-serif}\n"
                "a{color:#8ab4f8}h1,h2{line-height:1.2}code,pre{background:#23282d;padding:0 "
                ".2em}pre{overflow-x:auto;padding:.4em}\n"
                "table{border-collapse:collapse;width:100%}th,td{border:1px solid #3c4043;padding:.3rem "
                ".6rem;text-align:left;vertical-align:top}\n"
                "input,button{font:inherit;padding:.4rem;background:#23282d;color:inherit;border:1px solid #5f6368}\n"};
}

}  // namespace tessera
