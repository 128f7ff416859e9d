#include "scene/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "core/suggest.hpp"
#include "core/units.hpp"

namespace talus::scene {

const Node* Node::find(const std::string& key) const {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry.value;
  return nullptr;
}

Node* Node::find(const std::string& key) { return const_cast<Node*>(std::as_const(*this).find(key)); }

std::string kind_name(const Node& node) {
  switch (node.kind) {
    case Node::Kind::none: return "nothing";
    case Node::Kind::boolean: return "true or false";
    case Node::Kind::integer: return "a whole number";
    case Node::Kind::number: return "a decimal number";
    case Node::Kind::text: return "a text";
    case Node::Kind::array: return "a list";
    case Node::Kind::table: return "a table";
    case Node::Kind::other: return "a date or time";
  }
  return {};
}

namespace {
void append_text(const Node& node, std::string& out, int depth) {
  if (out.size() > 80) return;
  switch (node.kind) {
    case Node::Kind::none: break;
    case Node::Kind::boolean: out += node.boolean ? "true" : "false"; break;
    case Node::Kind::integer: out += fmt::format("{}", node.integer); break;
    case Node::Kind::number: out += exact_text(node.number); break;
    case Node::Kind::text: out += '"' + node.text + '"'; break;
    case Node::Kind::other: out += node.text; break;
    case Node::Kind::array:
    case Node::Kind::table: {
      const bool array = node.kind == Node::Kind::array;
      out += array ? "[" : "{";
      bool first = true;
      const auto separate = [&] {
        if (!first) out += ", ";
        first = false;
      };
      if (depth < 8) {
        for (const Node& item : node.items) {
          separate();
          append_text(item, out, depth + 1);
        }
        for (const Node::Entry& entry : node.entries) {
          separate();
          out += entry.key + " = ";
          append_text(entry.value, out, depth + 1);
        }
      }
      out += array ? "]" : "}";
      break;
    }
  }
}
}  // namespace

std::string value_text(const Node& node) {
  std::string text;
  append_text(node, text, 0);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  if (text.size() > 64) {
    std::size_t cut = 60;
    while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80)
      --cut;  // never inside a UTF-8 letter
    text.resize(cut);
    text += "...";
  }
  return text;
}

namespace {

std::string name_of(const Node& table) {
  if (const Node* between = table.find("between"); between && between->items.size() == 2)
    return between->items[0].text + "/" + between->items[1].text;
  const Node* name = table.find("name");
  return name && name->kind == Node::Kind::text ? name->text : std::string();
}

/// The name of an entry without one, from its place in the list; empty where there are none such.
std::string name_by_place(const std::string& list, std::size_t place) {
  return list == "block"       ? fmt::format("B{}", place + 1)
         : list == "structure" ? fmt::format("S{}", place + 1)
         : list == "joint_set" ? fmt::format("J{}", place + 1)
         : list == "joint"     ? fmt::format("K{}", place + 1)
                               : std::string();
}

std::string name_in(const std::string& list, const Node& array, std::size_t place) {
  const Node& item = array.items[place];
  return item.kind == Node::Kind::table && item.find("name") == nullptr && item.find("between") == nullptr
             ? name_by_place(list, place)
             : name_of(item);
}

/// Place of the entry that the rest of a key begins with, the size of the list if there is none. Names may
/// hold dots: the longest name counts.
std::size_t find_named(const std::string& list, const Node& array, const std::string& rest,
                       std::size_t& used) {
  std::size_t found = array.items.size();
  for (std::size_t i = 0; i < array.items.size(); ++i) {
    const std::string name = name_in(list, array, i);
    std::vector<std::string> forms{name};
    if (const auto slash = name.find('/'); slash != std::string::npos && array.items[i].find("between"))
      forms.push_back(name.substr(slash + 1) + "/" + name.substr(0, slash));
    for (const std::string& form : forms)
      if (!form.empty() && rest.compare(0, form.size(), form) == 0 &&
          (rest.size() == form.size() || rest[form.size()] == '.') && form.size() > used) {
        used = form.size();
        found = i;
      }
  }
  if (found < array.items.size()) return found;
  std::size_t place = 0;
  const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), place);
  const auto length = static_cast<std::size_t>(end - rest.data());
  if (status == std::errc{} && (length == rest.size() || rest[length] == '.') && place < array.items.size()) {
    used = length;
    return place;
  }
  return array.items.size();
}

}  // namespace

KeyPlace place_of_key(const Node& root, const std::string& key) {
  KeyPlace found{"", &root};
  std::string rest = key, list;
  while (!rest.empty() && found.value) {
    std::size_t used = 0;
    if (found.value->kind == Node::Kind::array) {
      const Node& array = *found.value;
      const std::size_t place = find_named(list, array, rest, used);
      if (place == array.items.size()) return {key, nullptr};
      found = {found.key + std::to_string(place) + ".", &array.items[place]};
    } else {
      used = std::min(rest.find('.'), rest.size());
      list = rest.substr(0, used);
      found = {found.key + list + ".", found.value->find(list)};
    }
    rest.erase(0, used + 1);
  }
  found.key += rest;
  if (found.key.ends_with('.')) found.key.pop_back();
  return found;
}

void set_value(Node& root, const std::string& key, const std::string& value, std::vector<Problem>& problems) {
  const Where where{"--set " + key, 0, 0};
  const auto fail = [&](std::string rule, std::string remedy) {
    Problem problem;
    problem.file = "--set";
    problem.key = key;
    problem.value = value;
    problem.rule = std::move(rule);
    problem.remedy = std::move(remedy);
    problems.push_back(std::move(problem));
  };
  if (key.empty() || key.front() == '.' || key.back() == '.' || key.find("..") != std::string::npos) {
    fail("the key is not a dotted name", "write for example --set simulation.step=\"1e-4 s\"");
    return;
  }
  Node* at = &root;
  std::string rest = key, list;  // the list that the key is in
  while (true) {
    if (at->kind == Node::Kind::array) {
      std::size_t used = 0;
      const std::size_t place = find_named(list, *at, rest, used);
      Node* item = place < at->items.size() ? &at->items[place] : nullptr;
      if (!item || used >= rest.size()) {
        std::vector<std::string> names;
        for (std::size_t i = 0; i < at->items.size(); ++i)
          if (std::string name = name_in(list, *at, i); !name.empty()) names.push_back(std::move(name));
        const std::string wanted = rest.substr(0, rest.find('.'));
        const std::string near = nearest_name(wanted, names);
        if (item && item->kind != Node::Kind::table)
          fail("the key names one value of a list", "give the whole list: " + key.substr(0, key.rfind('.')));
        else if (item)
          fail("the key ends at a table", "add the key inside it, for example " + key + ".velocity");
        else if (!near.empty())
          fail(fmt::format("there is no \"{}\" here", wanted), fmt::format("did you mean \"{}\"?", near));
        else
          fail(fmt::format("there is no \"{}\" here", wanted),
               "name one of the scene's, or its place from 0");
        return;
      }
      at = item;
      rest = rest.substr(used + 1);
      continue;
    }
    if (at->kind != Node::Kind::table) {
      fail("the key goes on below a value that is no table", "shorten the key");
      return;
    }
    const auto dot = rest.find('.');
    const std::string part = rest.substr(0, dot);
    Node* child = at->find(part);
    if (dot == std::string::npos) {
      Node parsed = parse_toml_value(value, where.file);
      if (child)
        *child = std::move(parsed);
      else
        at->entries.push_back({part, where, std::move(parsed)});
      return;
    }
    if (!child) {
      Node table;
      table.kind = Node::Kind::table;
      table.where = where;
      at->entries.push_back({part, where, std::move(table)});
      child = &at->entries.back().value;
    }
    at = child;
    list = part;
    rest = rest.substr(dot + 1);
  }
}

}  // namespace talus::scene
