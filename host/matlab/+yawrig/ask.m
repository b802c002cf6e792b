function answer = ask(verb, files, varargin)
% ASK  The answer of one of yawrig's verbs, as a struct with the names of its JSON.
%
%   answer = yawrig.ask('plan', {'model.toml'}, 'rival', {'free_play', 'coulomb_friction'})
%
% FILES is a cell array of paths. Options are pairs of a flag's name (from_deg for --from-deg) and its value: a number, a
% word, true for a flag that takes none, a cell array for one that is repeated. The program is `yawrig` in the path, or
% what the environment variable YAWRIG names. What it refuses is an error with its sentence.
  words = [{program(), verb}, flags(varargin), {'--json', '--'}, files];
  said = tempname();
  clean = onCleanup(@() discard(said));
  [code, text] = system([strjoin(cellfun(@quoted, words, 'UniformOutput', false), ' '), ' 2>', quoted(said)]);
  if code ~= 0
    message = strtrim(fileread(said));
    error('yawrig:refused', '%s', strrep(message, 'yawrig: ', ''));
  end
  answer = jsondecode(text);
end

function path = program()
  path = getenv('YAWRIG');
  if isempty(path)
    path = 'yawrig';
  end
end

function words = flags(options)
  words = {};
  for k = 1:2:numel(options)
    flag = ['--', strrep(options{k}, '_', '-')];
    value = options{k + 1};
    if iscell(value)
      for each = value(:)'
        words{end + 1} = [flag, '=', each{1}]; %#ok<AGROW>
      end
    elseif islogical(value)
      if value
        words{end + 1} = flag; %#ok<AGROW>
      end
    elseif ischar(value)
      words{end + 1} = [flag, '=', value]; %#ok<AGROW>
    else
      words{end + 1} = sprintf('%s=%.17g', flag, value); %#ok<AGROW>
    end
  end
end

function word = quoted(word)
  if ispc()
    word = ['"', word, '"'];
  else
    word = ['''', strrep(word, '''', '''\'''''), ''''];
  end
end

function discard(file)
  if exist(file, 'file')
    delete(file);
  end
end
