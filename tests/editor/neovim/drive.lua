-- Drives a Neovim whose configuration starts `rungd lsp`, in the project of tests/editor/project.rs,
-- as a user's keys would, and writes what happened as JSON: tests/editor/neovim.rs judges it.
-- `RUNGD_RESULT` names the file. It waits for events, never for a time; a wait that is too long is
-- the result `failure`.

local result = {}
local PATIENCE_MS = 120 * 1000

local function wait_for(what, is_so)
    assert(vim.wait(PATIENCE_MS, is_so, 10), 'waited in vain for ' .. what)
end

local function lines()
    return vim.api.nvim_buf_get_lines(0, 0, -1, false)
end

-- Puts the cursor on the first character of a text that stands in the buffer once.
local function go_to(text, behind)
    for row, line in ipairs(lines()) do
        local at = line:find(text, 1, true)
        if at then
            vim.api.nvim_win_set_cursor(0, { row, at - 1 + (behind or 0) })
            return
        end
    end
    error(text .. ' is not in the buffer')
end

local function replace(text, by)
    go_to(text)
    local row, column = unpack(vim.api.nvim_win_get_cursor(0))
    vim.api.nvim_buf_set_text(0, row - 1, column, row - 1, column + #text, { by })
end

local function findings()
    return vim.diagnostic.get(0)
end

local function text_of(name)
    local buffer = vim.fn.bufnr(name)
    if buffer < 0 or not vim.api.nvim_buf_is_loaded(buffer) then
        return ''
    end
    return table.concat(vim.api.nvim_buf_get_lines(buffer, 0, -1, false), '\n') .. '\n'
end

-- The lines of a floating window, when there is one.
local function floating()
    for _, window in ipairs(vim.api.nvim_list_wins()) do
        if vim.api.nvim_win_get_config(window).relative ~= '' then
            local buffer = vim.api.nvim_win_get_buf(window)
            return table.concat(vim.api.nvim_buf_get_lines(buffer, 0, -1, false), '\n')
        end
    end
end

local function find_and_mend()
    wait_for('the server', function() return #vim.lsp.buf_get_clients(0) == 1 end)
    replace('OUT valve', 'OUT valvve')
    wait_for('a finding', function() return #findings() == 1 end)
    local found = findings()[1]
    result.finding = { message = found.message, line = found.lnum, column = found.col, code = found.code }
    -- The correction that a user would choose from the list.
    vim.ui.select = function(items, _, choose)
        result.corrections = vim.tbl_map(function(item) return item[2].title end, items)
        choose(items[1], 1)
    end
    go_to('OUT valvve', #'OUT ')
    vim.lsp.buf.code_action()
    wait_for('the correction', function() return text_of('plant.toml'):find('OUT valve"', 1, true) end)
    wait_for('no finding', function() return #findings() == 0 end)
end

-- What omni completion offers (CTRL-X CTRL-O).
local function complete()
    replace('OUT valve', 'OUT va')
    go_to('OUT va', #'OUT va')
    local given = vim.lsp.util.make_position_params()
    local answers = assert(vim.lsp.buf_request_sync(0, 'textDocument/completion', given, PATIENCE_MS))
    local _, answer = next(answers)
    assert(answer and answer.result, vim.inspect(answers))
    local items = vim.lsp.util.text_document_completion_list_to_complete_items(answer.result, 'va')
    result.completion = vim.tbl_map(function(item) return item.word end, items)
    replace('OUT va', 'OUT valve')
end

local function explain()
    go_to('OUT valve', #'OUT ')
    vim.lsp.buf.hover()
    wait_for('an explanation', floating)
    result.hover = floating()
    vim.cmd('silent! close')
    for _, window in ipairs(vim.api.nvim_list_wins()) do
        if vim.api.nvim_win_get_config(window).relative ~= '' then
            vim.api.nvim_win_close(window, true)
        end
    end
end

local function define()
    go_to('OUT valve', #'OUT ')
    local before = vim.api.nvim_win_get_cursor(0)[1]
    vim.lsp.buf.definition()
    wait_for('the definition', function() return vim.api.nvim_win_get_cursor(0)[1] ~= before end)
    result.definition = vim.api.nvim_get_current_line()
end

local function rename()
    go_to('OUT valve', #'OUT ')
    vim.lsp.buf.rename('gate')
    wait_for('the new name in all files', function()
        return text_of('plant.toml'):find('OUT gate', 1, true)
            and text_of('rungd.toml'):find('"gate"', 1, true)
            and text_of('plant.test.toml'):find('expect: gate', 1, true)
    end)
    result.renamed = {}
    for _, name in ipairs({ 'plant.toml', 'rungd.toml', 'plant.test.toml' }) do
        result.renamed[name] = text_of(name)
    end
end

local function format()
    if vim.lsp.buf.format then
        vim.lsp.buf.format({ timeout_ms = PATIENCE_MS })
    else
        vim.lsp.buf.formatting_sync(nil, PATIENCE_MS)
    end
    result.formatted = text_of('plant.toml')
end

local function drive()
    find_and_mend()
    complete()
    explain()
    define()
    rename()
    format()
end

local is_well, failure = xpcall(drive, debug.traceback)
if not is_well then
    result.failure = failure
end
local file = assert(io.open(os.getenv('RUNGD_RESULT'), 'w'))
file:write(vim.json.encode(result))
file:close()
vim.cmd('qa!')
