function columns = as_table(rows)
% AS_TABLE  Rows of a result as columns: a quantity as two, NAME and NAME_u; what is neither number nor word is left out.
% A table in MATLAB, a struct in Octave.
  if iscell(rows)
    error('yawrig:refused', 'the rows have not all the same names');
  end
  out = struct();
  for name = fieldnames(rows)'
    values = {rows.(name{1})};
    values(cellfun(@isempty, values)) = {NaN};
    if all(cellfun(@(v) isnumeric(v) && isscalar(v), values))
      out.(name{1}) = vertcat(values{:});
    elseif all(cellfun(@ischar, values))
      out.(name{1}) = values(:);
    elseif any(cellfun(@(v) isstruct(v) && isscalar(v) && isfield(v, 'u'), values))
      out.(name{1}) = cellfun(@(v) of(v, 'value'), values(:));
      out.([name{1}, '_u']) = cellfun(@(v) of(v, 'u'), values(:));
    end
  end
  if exist('struct2table', 'file') && ~exist('OCTAVE_VERSION', 'builtin')
    columns = struct2table(out);
  else
    columns = out;
  end
end

function number = of(quantity, name)
  number = NaN;
  if isstruct(quantity) && ~isempty(quantity.(name))
    number = quantity.(name);
  end
end
