/* A double of what Flamenco's manager gives to the script of a job type: node flamenco_manager.js SCRIPT SETTINGS.
   Prints the settings and tasks of the job as JSON. It refuses what the manager's documentation does not have. */
"use strict";
const fs = require("fs");
const nodePath = require("path");
const vm = require("vm");

const [, , script, given] = process.argv;
const TYPES = ["string", "int32", "float", "bool"];
const SUBTYPES = ["file_path", "dir_path", "file_name", "hashed_file_path"];
const KEYS = ["key", "type", "subtype", "choices", "propargs", "description", "default", "eval", "evalInfo", "visible",
    "required", "editable", "label"];
const TASK_TYPES = ["blender", "ffmpeg", "file-management", "misc"];

function only(object, names, what) {
    for (const name of Object.keys(object)) {
        if (!names.includes(name)) throw new TypeError(`${what} has no ${name}`);
    }
}

class Task {
    constructor(name, type) {
        if (!TASK_TYPES.includes(type)) throw new TypeError(`no task type ${type}`);
        Object.assign(this, { name, type, commands: [], dependencies: [], added: false });
        Object.seal(this);
    }
    addCommand(command) {
        if (this.added) throw new Error("the manager has copied this task already");
        this.commands.push(command);
    }
    addDependency(task) {
        if (this.added) throw new Error("the manager has copied this task already");
        if (!task.added) throw new Error("a task depends on one that is not added");
        this.dependencies.push(task.name);
    }
}

function Command(name, parameters) {
    if (name !== "exec") throw new TypeError(`only exec is doubled, not ${name}`);
    only(parameters, ["exe", "args"], "exec");
    if (typeof parameters.exe !== "string" || !parameters.args.every((one) => typeof one === "string")) {
        throw new TypeError("exec takes texts");
    }
    return { name, parameters };
}

function shellSplit(text) {
    const words = text.match(/(?:[^\s"']+|"[^"]*"|'[^']*')+/g) || [];
    return words.map((word) => word.replace(/["']/g, ""));
}

const tasks = [];
const context = vm.createContext({
    author: { Task: (name, type) => new Task(name, type), Command },
    path: { join: nodePath.posix.join, dirname: nodePath.posix.dirname, basename: nodePath.posix.basename },
    print: (...words) => process.stderr.write(`${words.join(" ")}\n`),
    shellSplit,
});
vm.runInContext(`"use strict";\n${fs.readFileSync(script, "utf8")}\nthis.type = JOB_TYPE; this.compile = compileJob;`, context,
    { filename: script });
const type = context.type;
only(type, ["label", "description", "settings"], "a job type");
for (const setting of type.settings) {
    only(setting, KEYS, "a setting");
    if (!TYPES.includes(setting.type) || (setting.subtype && !SUBTYPES.includes(setting.subtype))) {
        throw new TypeError(`no type ${setting.type} ${setting.subtype}`);
    }
}
const settings = Object.fromEntries(type.settings.map((setting) => [setting.key, setting.default]));
context.compile({
    name: "Job",
    settings: { ...settings, ...JSON.parse(given) },
    addTask: (task) => {
        task.added = true;
        tasks.push(JSON.parse(JSON.stringify(task)));
    },
});
process.stdout.write(JSON.stringify({ settings: type.settings, tasks }));
