function found = compare(varargin)
% COMPARE  A second-order model with effects on top of it, fitted to records.
%
%   found = yawrig.compare(time_s, angle_deg, 'effect', {'coulomb_friction'})
%   found = yawrig.compare('r.csv', 'model', 'model.toml')
%
% FOUND has the names of the program's JSON: modal, parameters, residual_over_noise, where and more.
  [files, options, clean] = yawrig.recorded(varargin); %#ok<ASGLU>
  if ~any(strcmp(options(1:2:end), 'model'))
    options = [options, {'no_model', true}];
  end
  found = yawrig.ask('compare', files, options{:});
end
