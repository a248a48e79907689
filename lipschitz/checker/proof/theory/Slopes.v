(** Accepted norms and slopes hold: by a matrix inequality, by a vector, by a product of norms. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Sorting Checker Meaning Steepness Sets Distance Blocks
    Lower Values Fixed Enclosures Intervals Derivatives Centred Claims.
Import ListNotations.
Open Scope R_scope.

Lemma realm_apply m v : reals (apply zero add mul m v) = applyR (realm m) (reals v).
Proof. apply (f_apply zero add mul 0 Rplus Rmult real real_zero real_add real_mul). Qed.
Lemma real_square v : real (squareD v) = square (reals v).
Proof. apply (f_dot zero add mul 0 Rplus Rmult real real_zero real_add real_mul). Qed.

(** Norms *)
Lemma weights_matrix ps p layer : weights_at ps p layer = realm (matrix_at ps p layer).
Proof. reflexivity. Qed.
Lemma norm_above_sound w u rho t f : check [] [] w u rho t f = true ->
  forall d, norm (applyR (realm w) d) <= real u * norm d.
Proof.
  intros H d. set (n := inputs [] w). set (b := repeat 0 (length w)).
  assert (length b = length w) as Hb by apply repeat_length.
  assert (instance ([], w) ([], (realm w, b))) as I by (split; [constructor|split; auto]).
  pose proof (check_sound [] [] w u rho t f H _ I (trim n d) (repeat 0 n) (length_trim n d) (repeat_length 0 n)
    Logic.I) as B.
  unfold run in B. simpl in B. rewrite minus_affine in B by (now rewrite map_length).
  rewrite <- (length_trim n d) in B at 2 4. rewrite minus_zeros in B.
  assert (is_nonnegative u = true /\ shapes n [] w = true) as [Hu Hs].
  { unfold check in H. apply andb_prop in H. destruct H as [S H]. repeat both H. auto. }
  rewrite apply_trim in B.
  - eapply Rle_trans; [exact B|]. apply Rmult_le_compat_l; [now apply real_nonnegative|]. apply norm_le, square_trim.
  - simpl in Hs. rewrite forallb_forall in Hs. apply Forall_forall. intros r Hr. apply in_map_iff in Hr.
    destruct Hr as (r' & <- & Hr). rewrite map_length. apply Nat.eqb_eq. auto.
Qed.
Lemma norm_below_sound w l v : check_norm_below w l v = true ->
  exists d, length d = length (hd [] (realm w)) /\ 0 < norm d /\ real l * norm d <= norm (applyR (realm w) d).
Proof.
  unfold check_norm_below. intros H. repeat both H. apply Nat.eqb_eq in H. exists (reals v). repeat split.
  - rewrite map_length, H. destruct w; simpl; auto. now rewrite map_length.
  - apply sqrt_lt_R0. rewrite <- real_square. now apply real_positive.
  - apply at_most_real in H0. rewrite !real_mul, !real_square, realm_apply in H0. apply real_nonnegative in H2.
    unfold norm. rewrite <- (sqrt_square (real l)) at 1 by auto. rewrite <- sqrt_mult_alt by nra.
        now apply sqrt_le_1_alt.
Qed.

(** Slopes by a matrix inequality *)
(** Part p with each function divided by its b, and the matrix behind it multiplied by that. *)
Definition scaled_layer (b : R) (l : layer) : layer := (scale_allR b (fst l), snd l).
Definition divided_act (a : activation) (t : R) : R := / real (unit_of a) * act a t.
Fixpoint scaled_layers (b : R) (between : list activation) (later : list layer) (last : layer) : real_stack :=
  match later with
  | [] => ([], scaled_layer b last)
  | l :: later' =>
      let a := hd Relu between in
      let rest := scaled_layers (real (unit_of a)) (tl between) later' last in
      ((divided_act a, scaled_layer b l) :: fst rest, snd rest)
  end.
Definition stack_of (p : part) : real_stack :=
  match hidden p with
  | [] => ([], real_layer (outer p))
  | first :: later =>
      let a := hd Relu (between p) in
      let rest := scaled_layers (real (unit_of a)) (tl (between p)) (map real_layer later) (real_layer (outer p)) in
      ((divided_act a, real_layer first) :: fst rest, snd rest)
  end.
(** Without division. *)
Definition functions_and_layers (between : list activation) (hidden : list layer) : list ((R -> R) * layer) :=
  map (fun l => (act (fst l), snd l)) (following between hidden).
Lemma affine_scaled b (l : layer) x :
  affine (fst (scaled_layer b l)) (snd (scaled_layer b l)) x = affine (fst l) (snd l) (scaleR b x).
Proof.
  unfold affine. f_equal. simpl. rewrite apply_scale_all. unfold apply, scale. rewrite map_map. apply map_ext. intros r.
  symmetry. apply dot_scale_r.
Qed.
Lemma scale_divided a x : scaleR (real (unit_of a)) (map (divided_act a) x) = map (act a) x.
Proof.
  destruct (divided_range_holds a) as [P _]. unfold scale, divided_act. rewrite map_map. apply map_ext. intros t.
  field. lra.
Qed.
Lemma scaled_run b between later last x : run (scaled_layers b between later last) x =
  network (functions_and_layers between later) last (scaleR b x).
Proof.
  revert b between x. induction later as [|[m c] later IH]; intros b between x; [apply (affine_scaled b last)|].
  unfold run in *. simpl. rewrite IH, scale_divided. unfold functions_and_layers. f_equal. f_equal.
  apply (affine_scaled b (m, c)).
Qed.
Lemma entrywise_first between : forallb is_entrywise between = true ->
  is_entrywise (hd Relu between) = true /\ forallb is_entrywise (tl between) = true.
Proof. destruct between; simpl; auto. intros H. now apply andb_prop in H. Qed.
Lemma unclamped_network p x : entrywise_between p = true -> unclamped p x =
  network (functions_and_layers (between p) (map real_layer (hidden p))) (real_layer (outer p)) x.
Proof.
  unfold entrywise_between, unclamped, functions_and_layers. generalize (between p) as s. revert x.
  induction (map real_layer (hidden p)) as [|[m c] ls IH]; intros x s H; simpl; auto.
  destruct (entrywise_first s H) as [E H']. rewrite IH by auto. f_equal.
  destruct (hd Relu s); try discriminate; reflexivity.
Qed.
Lemma value_run p x : entrywise_between p = true -> value p x = run (stack_of p) (clamped (clamp p) x).
Proof.
  intros H. unfold value. rewrite unclamped_network by auto. unfold stack_of, functions_and_layers.
  destruct (hidden p) as [|[m c] later]; [reflexivity|].
  set (a := hd Relu (between p)). set (y := clamped (clamp p) x).
  pose proof (scaled_run (real (unit_of a)) (tl (between p)) (map real_layer later) (real_layer (outer p))
    (map (divided_act a) (affine (fst (real_layer (m, c))) (snd (real_layer (m, c))) y))) as R.
  rewrite scale_divided in R. symmetry. exact R.
Qed.
Lemma relu_entrywise p : relu_between p = true -> entrywise_between p = true.
Proof.
  unfold relu_between, entrywise_between. rewrite !forallb_forall. intros H a Ha. specialize (H a Ha).
  now destruct a.
Qed.
Lemma relu_part p : relu_between p = true -> all_relu p.
Proof.
  unfold relu_between, all_relu. rewrite forallb_forall, Forall_forall. intros H a Ha. specialize (H a Ha).
  now destruct a.
Qed.
Lemma relu_network p x : relu_between p = true ->
  unclamped p x = network (relu_layers (hidden p)) (real_layer (outer p)) x.
Proof.
  intros H. rewrite unclamped_network by now apply relu_entrywise. f_equal. apply relu_part in H. unfold all_relu in H.
  unfold functions_and_layers, relu_layers. generalize (between p) as s, H. clear H.
  induction (hidden p) as [|l ls IH]; intros s H; simpl; auto. destruct H as [|a s <- H]; simpl; f_equal.
  - apply IH. constructor.
  - now apply IH.
Qed.
Lemma map_const {A B} (i : B) (l : list A) : map (fun _ => i) l = repeat i (length l).
Proof. induction l; simpl; congruence. Qed.
(** Functions that have one range everywhere. *)
Lemma along_everywhere hidden ranges x x' : Forall (fun k => bias_fits (snd k)) hidden ->
  Forall2 (fun (k : (R -> R) * layer) r => exists i, r = repeat i (length (weights k)) /\
    slopes (fst k) (real (fst i)) (real (snd i))) hidden ranges ->
  along hidden (real_ranges ranges) x x'.
Proof.
  intros B H. revert x x'. induction H as [|[f [m c]] r hidden ranges [i [-> S]] H IH]; intros x x'; cbn; auto.
  inversion B as [|? ? Bm B']; subst. unfold bias_fits, weights in *. cbn [fst snd] in *. split; auto.
  rewrite <- (map_const i m), map_map, map_const, <- (length_affine m c x Bm).
  apply slopes_increments; auto. now rewrite !length_affine.
Qed.
Lemma fits_layer p l : fits_part p = true -> In l (layers p) -> length (snd l) = length (fst l).
Proof. unfold fits_part. rewrite forallb_forall. intros H G. now apply Nat.eqb_eq, H. Qed.
Lemma instance_matrices p : fits_part p = true -> instance (matrices p) (stack_of p).
Proof.
  intros H.
  assert (forall l, In l (layers p) -> of_matrix (fst l) (real_layer l)) as F.
  { intros l Hl. split; [reflexivity|]. simpl. rewrite map_length. now apply (fits_layer p). }
  assert (forall b l, In l (layers p) ->
    of_matrix (scale_all mul b (fst l)) (scaled_layer (real b) (real_layer l))) as Q.
  { intros b l Hl. destruct (F l Hl) as [_ B]. split; simpl in *.
    - symmetry. apply (f_scale_all mul Rmult real real_mul).
    - rewrite B. unfold scale_all. now rewrite map_length. }
  unfold matrices, stack_of, layers in *. destruct (hidden p) as [|first later]; simpl.
  - split; [constructor|]. apply F. now left.
  - assert (of_matrix (fst first) (real_layer first)) as F1 by (apply F; now left).
    assert (forall b l, In l (later ++ [outer p]) ->
      of_matrix (scale_all mul b (fst l)) (scaled_layer (real b) (real_layer l))) as Q'
      by (intros; apply Q; now right).
    clear F Q. generalize (unit_of (hd Relu (between p))) as b, (tl (between p)) as s.
    assert (forall b s, instance (scaled_matrices b s later (outer p))
      (scaled_layers (real b) s (map real_layer later) (real_layer (outer p)))) as I.
    { induction later as [|l later IH]; intros b s; simpl.
      - split; [constructor|]. apply Q'. now left.
      - destruct (IH ltac:(intros; apply Q'; now right) (unit_of (hd Relu s)) (tl s)) as [I1 I2].
        split; [|exact I2]. constructor; [|exact I1]. apply Q'. now left. }
    intros b s. destruct (I b s) as [I1 I2]. split; [|exact I2]. constructor; [exact F1|exact I1].
Qed.
Lemma divided_along p x x' : fits_part p = true ->
  along (fst (stack_of p)) (real_ranges (ranges_by divided_range p)) x x'.
Proof.
  intros H. destruct (instance_matrices p H) as [I _].
  apply along_everywhere; [now apply (stages_fit (fst (matrices p)))|].
  clear. unfold ranges_by, stack_of. destruct (hidden p) as [|first later]; [constructor|]. cbn.
  constructor; [|generalize (real (unit_of (hd Relu (between p)))) as b, (tl (between p)) as s;
    induction later as [|l later IH]; intros b s; cbn; constructor; [|apply IH]];
    eexists; (split; [rewrite map_const; unfold weights, scale_all; cbn; now rewrite ?map_length|
      apply divided_range_holds]).
Qed.
Lemma length_value p x : fits_part p = true -> length (value p x) = length (fst (outer p)).
Proof.
  intros H. assert (length (snd (outer p)) = length (fst (outer p))) as L
    by (apply (fits_layer p); auto; apply in_or_app; right; now left).
  unfold value, unclamped. generalize (between p) as s, (clamped (clamp p) x) as y.
  induction (map real_layer (hidden p)) as [|l ls IH]; intros s y; simpl; auto.
  rewrite length_affine by (simpl; now rewrite !map_length). simpl. now rewrite map_length.
Qed.
Lemma distance_nonneg scale x y : 0 <= distance scale x y. Proof. apply sqrt_pos. Qed.

(** For a bound of n by movements in units of their scale. *)
Lemma moved_bound moves scale c u n x y :
  positive_scale scale = true -> 0 <= u -> agree moves x y ->
  (forall v w base, length v = count moves -> length w = count moves -> length base = length moves ->
    plusR (applyR (realm (selector moves scale)) v) base = clamped c x ->
    plusR (applyR (realm (selector moves scale)) w) base = clamped c y -> n <= u * norm (minus v w)) ->
  n <= u * distance scale x y.
Proof.
  intros Hs Hu Ha Hn. pose proof (agree_clamped c _ _ _ Ha) as Hc. destruct (agree_lengths _ _ _ Hc) as [Hx Hy].
  eapply Rle_trans.
  - apply (Hn (movement moves scale (clamped c x)) (movement moves scale (clamped c y)) (staying moves (clamped c x)));
      auto using length_movement, length_staying; [|rewrite (agree_staying _ _ _ Hc)]; now apply selected.
  - apply Rmult_le_compat_l; auto. unfold norm. rewrite square_movement by auto. apply sqrt_le_1_alt, square_in_clamped.
    destruct (agree_lengths _ _ _ Ha). congruence.
Qed.

(** The parts of f, each after a vector has been added to what came before. *)
Definition stacks_of ps (f : function) (rest : list R) (of_part : part -> real_stack) : list (list R * real_stack) :=
  match f with
  | Alone p => [([], of_part (part_at ps p))]
  | Set_of phi rho => [([], of_part (part_at ps phi)); (rest, of_part (part_at ps rho))]
  end.
Lemma chain_sound ps f moves scale u rho t factor (matrices_of : part -> stack) (of_part : part -> real_stack) ranges
    rest x y :
  well_formed ps f moves scale = true -> forallb entrywise_between (parts_of ps f) = true -> is_nonnegative u = true ->
  check_parts (concat ranges) ([], selector moves scale) (map matrices_of (parts_of ps f)) u rho t factor = true ->
  (forall p, fits_part p = true -> instance (matrices_of p) (of_part p)) ->
  (forall p z, entrywise_between p = true -> value p z = run (of_part p) (clamped (clamp p) z)) ->
  agree moves x y -> let c := clamped (clamp (part_at ps (moved f))) in
  along_after (stacks_of ps f rest of_part) ranges (c x) (c y) ->
  norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y.
Proof.
  unfold well_formed. intros H He Hu HP HI HV Ha A. do 4 both H.
  rename H0 into Hl, H1 into Hs, H2 into Hm, H3 into Hc.
  apply real_nonnegative in Hu. set (S := selector moves scale) in *.
  assert (forall base, length base = length moves -> instance ([], S) ([], (realm S, base))) as I.
  { intros base Hb. split; [constructor|]. split; auto. simpl. unfold S. now rewrite length_selector. }
  assert (inputs [] S = count moves) as Hi by apply selector_columns.
  pose proof (check_parts_sound [] ranges _ _ _ _ _ _ HP) as C. clear HP. cbn [fst snd] in C.
  destruct f as [p|phi k]; cbn [parts_of map forallb tl moved value_of stacks_of] in *.
  - both H. both He. rewrite !HV by auto.
    apply (moved_bound moves scale (clamp (part_at ps p))); auto. intros v w base Hv Hw Hb Ex Ey.
    pose proof (C _ [([], of_part (part_at ps p))] (I base Hb)
      (Forall2_cons (matrices_of (part_at ps p)) ([], of_part (part_at ps p)) (HI _ H) (Forall2_nil _)) v w) as B.
    assert (forall z, run ([], (realm S, base)) z = plusR (applyR (realm S) z) base) as E1 by reflexivity.
    fold S in Ex, Ey. rewrite !E1, Ex, Ey in B. cbn [run_after] in B. rewrite !plus_nil_r in B.
    apply B; auto; first [congruence|exact Logic.I].
  - both H. both H0. apply andb_prop in He. destruct He as [He He']. both He'.
    both Hc. rewrite !HV by auto. destruct (clamp (part_at ps k)) eqn:E; [|discriminate]. simpl clamped.
    apply (moved_bound moves scale (clamp (part_at ps phi))); auto. intros v w base Hv Hw Hb Ex Ey.
    pose proof (C _ [([], of_part (part_at ps phi)); (rest, of_part (part_at ps k))] (I base Hb)
      (Forall2_cons (matrices_of (part_at ps phi)) ([], of_part (part_at ps phi)) (HI _ H)
        (Forall2_cons (matrices_of (part_at ps k)) (rest, of_part (part_at ps k)) (HI _ H0) (Forall2_nil _))) v w) as B.
    assert (forall z, run ([], (realm S, base)) z = plusR (applyR (realm S) z) base) as E1 by reflexivity.
    fold S in Ex, Ey. rewrite !E1, Ex, Ey in B. cbn [run_after] in B. rewrite !plus_nil_r in B.
    apply B; auto; first [congruence|exact Logic.I].
Qed.
Lemma slope_sound ps f moves scale u rho t factor :
  check_slope ps f moves scale u rho t factor = true -> holds ps (Slope_at_most f moves scale u).
Proof.
  unfold check_slope. intros H rest x y Ha _. do 3 both H. rewrite flat_map_concat_map in H0.
  apply (chain_sound ps f moves scale u rho t factor matrices stack_of _ rest x y H H2 H1 H0 instance_matrices
    (fun p z E => value_run p z E) Ha).
  unfold well_formed in H. do 4 both H. destruct f as [p|phi k]; cbn in *.
  - both H. split; auto. now apply divided_along.
  - both H. both H7. split; [now apply divided_along|]. split; auto. now apply divided_along.
Qed.

(** Slopes by products of norms *)
Definition norm_bound_of (l : layerD) (u : R) := 0 <= u /\ forall d, norm (applyR (fst (real_layer l)) d) <= u * norm d.
Definition product_R (us : list R) := fold_right Rmult 1 us.
Lemma find_norm_sound ps accepted p layer u : Forall (holds ps) accepted -> find_norm accepted p layer = Some u ->
  forall d, norm (applyR (weights_at ps p layer) d) <= real u * norm d.
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl; auto.
  destruct (Nat.eqb_spec p p0), (Nat.eqb_spec layer layer0); simpl; auto. intros E d. inversion E. subst. apply Hc.
Qed.
Lemma norms_sound ps accepted p v : Forall (holds ps) accepted ->
  forall ls before, layers (part_at ps p) = before ++ ls -> norms accepted p (length before) ls = Some v ->
  exists us, Forall2 norm_bound_of ls us /\ real v = product_R us.
Proof.
  intros HA ls. revert v. induction ls as [|l ls IH]; intros v before E; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. apply real_one.
  - destruct (find_norm accepted p (length before)) as [u|] eqn:Hu; [|discriminate].
    destruct (norms accepted p (S (length before)) ls) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative u) eqn:Hn; [|discriminate]. intros H. inversion H. subst.
    destruct (IH w (before ++ [l])) as (us & B & G).
    + now rewrite <- app_assoc.
    + now rewrite app_length, Nat.add_comm.
    + exists (real u :: us). rewrite real_mul. simpl. rewrite G. split; auto. constructor; auto. split.
      * now apply real_nonnegative.
      * intros d. pose proof (find_norm_sound _ _ _ _ _ HA Hu d) as F. unfold weights_at in F.
        rewrite E, nth_middle in F. exact F.
Qed.
Lemma product_nonneg ls us : Forall2 norm_bound_of ls us -> 0 <= product_R us.
Proof. intros H. induction H as [|l u ls us [Hu _] H IH]; simpl; [lra|]. now apply Rmult_le_pos. Qed.
Lemma affine_bound l u x y : norm_bound_of l u -> length (snd l) = length (fst l) ->
  norm (minus (affine (fst (real_layer l)) (snd (real_layer l)) x) (affine (fst (real_layer l)) (snd (real_layer l)) y))
      <= u * norm (minus x y).
Proof. intros [_ H] L. rewrite minus_affine by (simpl; now rewrite !map_length). apply H. Qed.
Definition with_slopes_R {A} (between : list activation) (hidden : list A) (u : R) : R :=
  fold_right (fun l v => real (steepest (fst l)) * v) u (following between hidden).
Lemma with_slopes_nonneg {A} between (hidden : list A) u : 0 <= u -> 0 <= with_slopes_R between hidden u.
Proof.
  intros Hu. revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  apply Rmult_le_pos; [apply all_slopes|apply IH].
Qed.
Lemma real_with_slopes {A} between (hidden : list A) u :
  real (with_slopes between hidden u) = with_slopes_R between hidden (real u).
Proof.
  revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  unfold with_slopes, with_slopes_R in *. simpl. now rewrite real_mul, IH.
Qed.
Lemma with_slopes_times {A} between (hidden : list A) a u :
  with_slopes_R between hidden (a * u) = a * with_slopes_R between hidden u.
Proof.
  revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  unfold with_slopes_R in *. simpl. rewrite IH. ring.
Qed.
Lemma activated_contracts a p q : length p = length q ->
  norm (minus (activated a p) (activated a q)) <= real (steepest a) * norm (minus p q).
Proof.
  intros E. destruct (all_slopes a) as [C S].
  assert (norm (minus (map (act a) p) (map (act a) q)) <= real (steepest a) * norm (minus p q)) as M.
  { unfold norm. rewrite <- (sqrt_square (real (steepest a))) at 1 by auto. rewrite <- sqrt_mult_alt by nra.
    apply sqrt_le_1_alt. now apply slopes_contract. }
  destruct a; try exact M. simpl. rewrite real_one, Rmult_1_l. apply norm_le. now apply sorting_contracts.
Qed.
(** One layer and what follows it: `step` lengthens no difference by more than c. *)
Lemma layer_bound (step : list R -> list R) c w k u : 0 <= c -> 0 <= w ->
  (forall p q, length p = length q -> norm (minus (step p) (step q)) <= c * norm (minus p q)) ->
  norm_bound_of k u -> length (snd k) = length (fst k) -> forall x y,
  w * norm (minus (step (affine (fst (real_layer k)) (snd (real_layer k)) x))
                  (step (affine (fst (real_layer k)) (snd (real_layer k)) y))) <= c * (u * w) * norm (minus x y).
Proof.
  intros Hc W Hs Hu L x y. pose proof (affine_bound k u x y Hu L) as B.
  set (p := affine _ _ x) in *. set (q := affine _ _ y) in *.
  assert (length p = length q) as E.
  { unfold p, q, real_layer. simpl. rewrite !length_affine; auto; rewrite !map_length; apply L. }
  replace (c * (u * w) * norm (minus x y)) with (w * (c * (u * norm (minus x y)))) by ring.
  apply Rmult_le_compat_l; auto. eapply Rle_trans; [now apply Hs|]. now apply Rmult_le_compat_l.
Qed.
Lemma layers_bound between hs l us : Forall2 norm_bound_of (hs ++ [l]) us ->
  (forall k, In k (hs ++ [l]) -> length (snd k) = length (fst k)) -> forall x y,
  let g := layer_by_layer between (map real_layer hs) (real_layer l) in
  norm (minus (g x) (g y)) <= with_slopes_R between hs (product_R us) * norm (minus x y).
Proof.
  revert between us. induction hs as [|k hs IH]; intros between us H L x y; simpl in *.
  - inversion H as [|? u ? us' Hu Hus]; subst. inversion Hus; subst. simpl. unfold with_slopes_R. simpl.
    rewrite Rmult_1_r. apply affine_bound; auto.
  - inversion H as [|? u ? us' Hu Hus]; subst.
    eapply Rle_trans; [apply (IH (tl between) us'); auto|]. unfold with_slopes_R. simpl.
    change (fold_right _ (u * product_R us') _) with (with_slopes_R (tl between) hs (u * product_R us')).
    rewrite with_slopes_times.
    apply (layer_bound (activated (hd Relu between)) (real (steepest (hd Relu between))) _ k u); auto.
    + apply all_slopes.
    + apply with_slopes_nonneg. eapply product_nonneg; eauto.
    + intros p q E. now apply activated_contracts.
Qed.
Lemma part_bound ps accepted p v : Forall (holds ps) accepted -> fits_part (part_at ps p) = true ->
  norm_of ps accepted p = Some v -> 0 <= real v /\ forall x y,
  norm (minus (unclamped (part_at ps p) x) (unclamped (part_at ps p) y)) <= real v * norm (minus x y).
Proof.
  unfold norm_of. intros HA Hf Hv. destruct (norms accepted p 0 _) as [w|] eqn:Hw; [|discriminate].
  inversion Hv. destruct (norms_sound ps accepted p w HA _ [] eq_refl Hw) as (us & B & E).
  rewrite real_with_slopes, E. split.
  - apply with_slopes_nonneg. eapply product_nonneg; eauto.
  - apply layers_bound; auto. intros k. now apply fits_layer.
Qed.
Lemma square_in_largest m scale d : (scale = [] \/ length d = length scale) -> positive_scale scale = true ->
  real (hd one scale) <= m -> Forall (fun s => real s <= m) scale -> square d <= m * m * square_in scale d.
Proof.
  intros Hl Hs Hh Hm. destruct Hl as [->|Hl].
  - rewrite square_in_one. simpl in Hh. rewrite real_one in Hh. pose proof (square_nonneg d).
    assert (1 <= m * m) by nra. nra.
  - clear Hh. unfold square. revert scale Hl Hs Hm. induction d as [|a d IH]; intros [|s scale]; simpl;
      try discriminate; intros Hl Hs Hm; [lra|].
    inversion Hm as [|? ? Hms Hm']; subst. apply andb_prop in Hs. destruct Hs as [Hs Hs']. apply real_positive in Hs.
    specialize (IH scale ltac:(lia) Hs' Hm').
    assert (a * a <= m * m * (a / real s * (a / real s))); [|lra].
    assert (a = real s * (a / real s)) as E by (field; lra). set (q := a / real s) in *. rewrite E.
    replace (real s * q * (real s * q)) with (real s * real s * (q * q)) by ring.
    apply Rmult_le_compat_r; [pose proof (Rle_0_sqr q); auto|]. apply Rmult_le_compat; lra.
Qed.
Lemma norm_in_largest m scale moves c x y : 0 <= m -> agree moves x y -> (scale = [] \/ length scale = length moves) ->
  positive_scale scale = true -> real (hd one scale) <= m -> Forall (fun s => real s <= m) scale ->
  norm (minus (clamped c x) (clamped c y)) <= m * distance scale x y.
Proof.
  intros H0 Ha Hl Hs Hh Hm. destruct (agree_lengths _ _ _ Ha) as [Hx Hy]. unfold distance.
  rewrite <- (sqrt_square m) by auto. rewrite <- sqrt_mult_alt by nra. apply sqrt_le_1_alt.
  eapply Rle_trans; [apply (square_in_largest m scale); auto|].
  - rewrite length_minus by (rewrite !length_clamped; congruence). rewrite length_clamped. destruct Hl; [left|right];
      congruence.
  - apply Rmult_le_compat_l; [nra|]. apply square_in_clamped. congruence.
Qed.
Lemma moved_fits ps f moves scale : well_formed ps f moves scale = true -> fits_part (part_at ps (moved f)) = true.
Proof. unfold well_formed. intros H. do 4 both H. destruct f; simpl in *; now both H. Qed.
Lemma product_with_sound ps accepted f moves scale u a rest x y : Forall (holds ps) accepted ->
  check_product_with ps accepted f moves scale u (Some a) = true -> agree moves x y -> 0 <= real a ->
  (let p := part_at ps (moved f) in let c := clamped (clamp p) in
    norm (minus (value p x) (value p y)) <= real a * norm (minus (c x) (c y))) ->
  norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y.
Proof.
  intros HA. unfold check_product_with. set (m := largest _ _). intros H Ha Ka Ba. do 3 both H.
  unfold well_formed in H. do 4 both H. rename H3 into Hl, H4 into Hs, H6 into Hc.
  destruct (behind_of ps accepted f) as [b|] eqn:Hb; [|discriminate]. apply at_most_real in H0, H2.
  rewrite !real_mul in H0.
  assert (Forall (fun s => real s <= real m) scale) as Hm.
  { rewrite forallb_forall in H1. apply Forall_forall. intros s G. now apply at_most_real, H1. }
  destruct (positive_hd _ Hs) as [Hp _].
  assert (scale = [] \/ length scale = length moves) as Hl'.
  { apply orb_prop in Hl. destruct Hl as [G|G]; [left; now destruct scale|right; now apply Nat.eqb_eq]. }
  assert (forall c, norm (minus (clamped c x) (clamped c y)) <= real m * distance scale x y) as D
    by (intros c; apply (norm_in_largest _ _ moves); auto; lra).
  pose proof (distance_nonneg scale x y) as Dn.
  set (first := norm (minus (value (part_at ps (moved f)) x) (value (part_at ps (moved f)) y))) in *.
  assert (first <= real a * (real m * distance scale x y)) as F
    by (eapply Rle_trans; [exact Ba|]; now apply Rmult_le_compat_l).
  assert (forall e, 0 <= real b -> e <= real b * first -> e <= real u * distance scale x y) as G.
  { intros e K E. apply Rle_trans with (real b * (real a * (real m * distance scale x y))).
    - eapply Rle_trans; [exact E|]. now apply Rmult_le_compat_l.
    - replace (real b * (real a * (real m * distance scale x y))) with (real m * (real a * real b) * distance scale x y)
        by ring. now apply Rmult_le_compat_r. }
  destruct f as [p|phi r]; cbn [parts_of forallb tl value_of behind_of moved] in *.
  - inversion Hb as [E]. rewrite <- E, real_one in G. apply G; [lra|]. rewrite Rmult_1_l. apply Rle_refl.
  - both H. both H3. both Hc. destruct (part_bound _ _ _ _ HA H3 Hb) as [Kb Bb].
    unfold value at 1 3. destruct (clamp (part_at ps r)) eqn:E; [|discriminate]. simpl clamped. apply G; auto.
    eapply Rle_trans; [apply Bb|]. apply Rmult_le_compat_l; auto. apply norm_le. unfold first, norm.
    rewrite square_shifted by (now rewrite !length_value). apply Rle_refl.
Qed.
Lemma product_sound ps accepted f moves scale u : Forall (holds ps) accepted ->
  check_product ps accepted f moves scale u = true -> holds ps (Slope_at_most f moves scale u).
Proof.
  intros HA H rest x y Ha _. unfold check_product in H. destruct (norm_of ps accepted (moved f)) as [a|] eqn:E.
  - pose proof H as W. unfold check_product_with in W. do 3 both W. apply moved_fits in W.
    destruct (part_bound _ _ _ _ HA W E) as [K B]. apply (product_with_sound _ _ _ _ _ _ _ _ _ _ HA H Ha K). apply B.
  - unfold check_product_with in H. both H. discriminate.
Qed.

(** By the slopes in a box *)
Lemma contracts_in (a : activation) c t p q d e : 0 <= c ->
  (forall n, In n t -> let (l, h) := slopes_between a (fst n) in real h <= c /\ - real l <= c) ->
  is_entrywise a = true -> Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  square (minus (map (act a) p) (map (act a) q)) <= c * c * square (minus p q).
Proof.
  intros C H E P. revert q. unfold square, minus. induction P as [|n y t p [L _] P IH]; intros q G; inversion G as
    [|? z ? q' [M _] G']; subst; simpl; [lra|].
  assert (forall n, In n t -> let (l, h) := slopes_between a (fst n) in real h <= c /\ - real l <= c) as H'
    by (intros; apply H; now right). specialize (IH H' q' G'). specialize (H n (or_introl eq_refl)).
  pose proof (slopes_between_hold a (fst n) E) as S. destruct (slopes_between a (fst n)) as [l h]. cbn [fst snd] in S.
  destruct H as [Hh Hl], L as [L1 L2], M as [M1 M2].
  assert (forall u v, real (fst (fst n)) <= u -> u <= v -> v <= real (snd (fst n)) ->
    (act a v - act a u) * (act a v - act a u) <= c * c * ((v - u) * (v - u))) as K.
  { intros u v U V W. destruct (S u v U V W) as [S1 S2].
    assert (- (c * (v - u)) <= act a v - act a u <= c * (v - u)) by nra.
    replace (c * c * ((v - u) * (v - u))) with ((c * (v - u)) * (c * (v - u))) by ring. nra. }
  assert ((act a y + -1 * act a z) * (act a y + -1 * act a z) <= c * c * ((y + -1 * z) * (y + -1 * z))) as Y.
  { destruct (Rle_lt_dec z y) as [O|O]; [specialize (K z y M1 O L2)|specialize (K y z L1 ltac:(lra) M2)]; lra. }
  lra.
Qed.
Lemma steepest_known_above a t : is_entrywise a = true -> 0 <= real (steepest_known a t) /\
  forall n, In n t -> let (l, h) := slopes_between a (fst n) in
    real h <= real (steepest_known a t) /\ - real l <= real (steepest_known a t).
Proof.
  intros E. assert (steepest_known a t =
    fold_right (fun n m => let (l, h) := slopes_between a (fst n) in larger (larger h (neg l)) m) zero t) as ->
    by (destruct a; auto; discriminate).
  induction t as [|n t [P IH]]; simpl; [rewrite real_zero; split; [lra|tauto]|].
  set (m := fold_right _ _ _) in *. destruct (slopes_between a (fst n)) as [l h] eqn:S.
  rewrite !real_larger, real_neg. pose proof (Rmax_l (Rmax (real h) (- real l)) (real m)).
  pose proof (Rmax_r (Rmax (real h) (- real l)) (real m)). pose proof (Rmax_l (real h) (- real l)).
  pose proof (Rmax_r (real h) (- real l)). split; [lra|]. intros k [<-|I]; [rewrite S; lra|].
  specialize (IH k I). destruct (slopes_between a (fst k)). lra.
Qed.
Lemma activated_contracts_in a t p q d e : Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  0 <= real (steepest_known a t) /\
  norm (minus (activated a p) (activated a q)) <= real (steepest_known a t) * norm (minus p q).
Proof.
  intros P G. destruct (is_entrywise a) eqn:E.
  - destruct (steepest_known_above a t E) as [C H]. split; auto. set (c := real (steepest_known a t)) in *.
    assert (activated a p = map (act a) p /\ activated a q = map (act a) q) as [-> ->]
      by (destruct a; auto; discriminate).
    unfold norm. rewrite <- (sqrt_square c) by auto. rewrite <- sqrt_mult_alt by nra. apply sqrt_le_1_alt.
    now apply (contracts_in a c t p q d e).
  - destruct a; try discriminate. simpl steepest_known. rewrite real_one, Rmult_1_l. split; [lra|].
    apply norm_le, sorting_contracts. now rewrite <- (related_length _ _ _ P), <- (related_length _ _ _ G).
Qed.
Lemma centred_layers_bound radius d e between hs l us s : bounded_by radius d -> bounded_by radius e ->
  Forall2 norm_bound_of (hs ++ [l]) us ->
  (forall k, In k (hs ++ [l]) -> length (snd k) = length (fst k)) -> forall x y,
  Forall2 (follows d) s x -> Forall2 (follows e) s y ->
  let g := layer_by_layer between (map real_layer hs) (real_layer l) in
  let c := real (steepest_centred radius (rounding_of radius) between hs s) in
  0 <= c /\ norm (minus (g x) (g y)) <= c * product_R us * norm (minus x y).
Proof.
  intros D E. revert between us s. induction hs as [|k hs IH]; intros between us s H L x y X Y; simpl in *.
  - inversion H as [|? u ? us' Hu Hus]; subst. inversion Hus; subst. simpl. rewrite real_one, Rmult_1_r, Rmult_1_l.
    split; [lra|]. apply affine_bound; auto.
  - inversion H as [|? u ? us' Hu Hus]; subst. set (a := hd Relu between).
    set (t := passed radius (rounding_of radius) (fst k) (snd k) s).
    set (p := affine (fst (real_layer k)) (snd (real_layer k)) x).
    set (q := affine (fst (real_layer k)) (snd (real_layer k)) y).
    assert (Forall2 (follows d) t p) as P by (apply passed_follow; auto).
    assert (Forall2 (follows e) t q) as G by (apply passed_follow; auto).
    destruct (activated_contracts_in a t p q d e P G) as [C B].
    destruct (IH (tl between) us' (activated_known a (rounding_of radius) t) Hus ltac:(auto) (activated a p)
      (activated a q) ltac:(now apply activated_known_follow) ltac:(now apply activated_known_follow)) as [C' B'].
    pose proof (product_nonneg _ _ Hus) as Up. pose proof (affine_bound k u x y Hu ltac:(auto)) as F. fold p q in F.
    rewrite real_mul. split; [now apply Rmult_le_pos|]. eapply Rle_trans; [exact B'|].
    set (c := real (steepest_known a t)) in *. set (c' := real (steepest_centred _ _ _ _ _)) in *.
    apply Rle_trans with (c' * product_R us' * (c * (u * norm (minus x y)))).
    + apply Rmult_le_compat_l; [now apply Rmult_le_pos|]. eapply Rle_trans; [exact B|]. now apply Rmult_le_compat_l.
    + right. simpl. ring.
Qed.
Lemma local_product_sound ps accepted f moves scale b u : Forall (holds ps) accepted ->
  check_local_product ps accepted f moves scale b u = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  intros HA H rest x y Ha _ X Y. unfold check_local_product in H.
  set (p := part_at ps (moved f)) in *. destruct (norms accepted (moved f) 0 (layers p)) as [v|] eqn:E.
  2: { unfold check_product_with in H. both H. discriminate. }
  simpl option_map in H. pose proof H as W. unfold check_product_with in W. do 3 both W. apply moved_fits in W.
  fold p in W. destruct (norms_sound ps accepted (moved f) v HA _ [] eq_refl E) as (us & B & Ev).
  apply (within_clamped (clamp p)) in X, Y.
  destruct (inputs_follow _ _ X) as (d & D & _ & F). destruct (inputs_follow _ _ Y) as (e & D' & _ & F').
  specialize (F O [] eq_refl). specialize (F' O [] eq_refl).
  destruct (centred_layers_bound _ d e (between p) (hidden p) (outer p) us _ D D' B
    (fun k => fits_layer p k W) _ _ F F') as [C N].
  apply (product_with_sound _ _ _ _ _ _ _ _ _ _ HA H Ha); rewrite real_mul, Ev.
  - apply Rmult_le_pos; [exact C|]. eapply product_nonneg; eauto.
  - exact N.
Qed.

(** By a matrix inequality with these slopes *)
Definition undivided_stack (p : part) : real_stack :=
  (functions_and_layers (between p) (map real_layer (hidden p)), real_layer (outer p)).
Lemma undivided_value p x : entrywise_between p = true -> value p x = run (undivided_stack p) (clamped (clamp p) x).
Proof. intros H. unfold value. now rewrite unclamped_network. Qed.
Lemma undivided_instance p : fits_part p = true -> instance (undivided_matrices p) (undivided_stack p).
Proof.
  intros H. assert (forall l, In l (layers p) -> of_matrix (fst l) (real_layer l)) as F.
  { intros l Hl. split; [reflexivity|]. simpl. rewrite map_length. now apply (fits_layer p). }
  split; [|apply F; unfold layers; apply in_or_app; right; now left].
  unfold undivided_matrices, undivided_stack, functions_and_layers. cbn [fst].
  assert (forall l, In l (hidden p) -> of_matrix (fst l) (real_layer l)) as G
    by (intros; apply F; unfold layers; apply in_or_app; now left).
  clear F. generalize (between p) as s. induction (hidden p) as [|l ls IH]; intros s; cbn; constructor.
  - apply G. now left.
  - apply IH. intros. apply G. now right.
Qed.
Lemma undivided_along p x x' : fits_part p = true ->
  along (fst (undivided_stack p)) (real_ranges (ranges_by range_of p)) x x'.
Proof.
  intros H. destruct (undivided_instance p H) as [I _].
  apply along_everywhere; [now apply (stages_fit (fst (undivided_matrices p)))|]. clear.
  unfold ranges_by, undivided_stack, functions_and_layers. cbn [fst]. generalize (between p) as s.
  induction (hidden p) as [|l ls IH]; intros s; cbn; constructor; [|apply IH].
  eexists. split; [rewrite map_const; unfold weights; cbn; now rewrite map_length|]. apply range_holds.
Qed.
Lemma increments_in a t p q d e : is_entrywise a = true -> Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  increments_within (act a) (map real_range (map (fun n => slopes_between a (fst n)) t)) p q.
Proof.
  intros E P. revert q. induction P as [|n y t p [[L1 L2] _] P IH]; intros q G;
    inversion G as [|? z ? q' [[M1 M2] _] G']; subst; cbn; auto. split; auto.
  pose proof (slopes_between_hold a (fst n) E) as S.
  destruct (Rle_lt_dec y z) as [O|O]; [specialize (S y z L1 O M2)|specialize (S z y M1 ltac:(lra) L2)]; nra.
Qed.
Lemma centred_along radius d e between hs s : bounded_by radius d -> bounded_by radius e ->
  forallb is_entrywise between = true ->
  (forall k, In k hs -> length (snd k) = length (fst k)) -> forall x y,
  Forall2 (follows d) s x -> Forall2 (follows e) s y ->
  along (functions_and_layers between (map real_layer hs))
    (real_ranges (ranges_centred radius (rounding_of radius) between hs s)) x y.
Proof.
  intros D E. revert between s. induction hs as [|k hs IH]; intros between s N L x y X Y; cbn; auto.
  set (a := hd Relu between).
  destruct (entrywise_first between N) as [A' N']. fold a in A'.
  assert (forall z, activated a z = map (act a) z) as M by (intros; destruct a; auto; discriminate).
  pose proof (passed_follow radius d (fst k) (snd k) s x D (L k (or_introl eq_refl)) X) as P.
  pose proof (passed_follow radius e (fst k) (snd k) s y E (L k (or_introl eq_refl)) Y) as G.
  split; [now apply (increments_in a _ _ _ d e)|]. apply IH; auto.
  - intros. apply L. now right.
  - rewrite <- M. now apply activated_known_follow.
  - rewrite <- M. now apply activated_known_follow.
Qed.
Lemma local_slope_sound ps f moves scale b u rho t factor :
  check_local_slope ps f moves scale b u rho t factor = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  unfold check_local_slope. intros H rest x y Ha _ X Y. do 3 both H.
  apply (chain_sound ps f moves scale u rho t factor undivided_matrices undivided_stack _ rest x y H H2 H1 H0
    undivided_instance undivided_value Ha).
  pose proof (moved_fits _ _ _ _ H) as W. set (p := part_at ps (moved f)) in *.
  assert (entrywise_between p = true) as N by (destruct f; cbn in H2; now both H2).
  apply (within_clamped (clamp p)) in X, Y.
  destruct (inputs_follow _ _ X) as (d & D & _ & F). destruct (inputs_follow _ _ Y) as (e & D' & _ & F').
  specialize (F O [] eq_refl). specialize (F' O [] eq_refl).
  assert (along (fst (undivided_stack p)) (real_ranges (ranges_on_box p b)) (clamped (clamp p) x) (clamped (clamp p) y))
    as A.
  { apply (centred_along _ d e); auto. intros k K. apply (fits_layer p k W). unfold layers. apply in_or_app. now left. }
  unfold local_ranges, p in *. destruct f as [q|phi k]; cbn [stacks_of moved along_after] in *; rewrite !plus_nil_r.
  - now split.
  - split; auto. split; auto. apply undivided_along. unfold well_formed in H. do 4 both H. cbn in H.
    apply andb_prop in H. destruct H as [_ H]. now both H.
Qed.
